"""VRPN: a recorded exchange with the VRPN project's own server, and that server where it is installed."""

from __future__ import annotations

import socket
import struct
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import HardwareError, InputError
from kendama_cli.plugins.shared.streams.vrpn import COOKIE, HEADER, VrpnStream, tracker_report
from tests.plugins.mocap.test_live import settings
from tests.plugins.swing_server import SWING, free_port, replayed, swing_by_json, vrpn_server

RECORDED = Path(__file__).with_name("vrpn_exchange.hex")


def recorded():
    """What vrpn_server sent from its greeting on; the file says how it was made."""
    return bytes.fromhex("".join(line for line in RECORDED.read_text().splitlines() if not line.startswith("#")))


def vrpn_settings(tmp_path, port, **changes):
    return settings(tmp_path, port, protocol="vrpn", **changes)


def far_from_swing(hand):
    """The largest distance [m] of the hand's path from the swing that was streamed, up to when and where it began."""
    samples = list(hand.samples())
    t_s, made_m = np.array([one.t_s for one in samples]), np.array([one.position_m for one in samples])
    first = int(np.linalg.norm(SWING[:, 1:] - made_m[0], axis=1).argmin())
    at_s = t_s + SWING[first, 0]
    truth = np.column_stack([np.interp(at_s, SWING[:, 0], column) for column in SWING[:, 1:].T])
    return np.abs(made_m - truth).max()


def test_a_recorded_exchange_is_the_swing_that_was_streamed():
    stream = VrpnStream()
    messages = [one for byte in recorded() for one in stream.feed(bytes([byte]))]
    reports = [one for one in map(tracker_report, messages) if one is not None]
    assert {(one.tracker, one.sensor) for one in reports} == {("cup", 0)}
    assert np.array([one.position for one in reports]) == pytest.approx(SWING[: len(reports), 1:], abs=1e-12)
    assert {one.rotation_wxyz for one in reports} == {(1.0, 0.0, 0.0, 0.0)}
    stamps_s = np.array([one.stamp_s for one in reports])
    assert np.abs(stamps_s - stamps_s[0] - SWING[: len(reports), 0]).max() < 0.005  # the server's own, as it ran


def test_a_recorded_exchange_becomes_a_demonstration(tmp_path):
    with replayed(recorded(), greeting=COOKIE) as port:
        (hand,) = open_demonstrators(vrpn_settings(tmp_path, port))
    assert far_from_swing(hand) < 0.01  # 5 ms at 2 m/s
    assert any("the server closed the line after" in one and "is kept" in one for one in hand.warnings)


def test_a_body_that_is_not_streamed_is_told_with_those_that_are(tmp_path):
    with (
        replayed(recorded(), greeting=COOKIE) as port,
        pytest.raises(HardwareError, match=r"the server closed the line after 0 poses; it streams cup$"),
    ):
        open_demonstrators(vrpn_settings(tmp_path, port, body="hand"))


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", r"does not speak VRPN 7 \(it greets with b'HTTP/1.1 400"),
        (b"vrpn: ver. 06.04  0".ljust(24, b"\0"), "does not speak VRPN 7"),
        (COOKIE + HEADER.pack(5, 0, 0, 0, 0, 0), "sent a message of 5 bytes, which is no VRPN"),
        (COOKIE + HEADER.pack(1 << 30, 0, 0, 0, 0, 0), "sent a message of 1073741824 bytes"),
    ],
    ids=["http", "old", "short", "long"],
)
def test_what_is_no_vrpn_is_told(tmp_path, sent, words):
    with (
        replayed(sent, greeting=COOKIE) as port,
        pytest.raises(HardwareError, match=f"the VRPN server at .* {words}.*; look at capture.protocol"),
    ):
        open_demonstrators(vrpn_settings(tmp_path, port))


def test_a_pose_of_another_length_is_told(tmp_path):
    kind = b"vrpn_Tracker Pos_Quat\0"
    named = HEADER.pack(28 + len(kind), 0, 0, 3, -2, 0) + struct.pack(">I", len(kind)) + kind
    named += bytes(-len(named) % 8)
    with (
        replayed(COOKIE + named + HEADER.pack(32, 0, 0, 0, 3, 0) + bytes(8), greeting=COOKIE) as port,
        pytest.raises(HardwareError, match="sent a pose of 8 bytes, not 64"),
    ):
        open_demonstrators(vrpn_settings(tmp_path, port))


def test_other_sensors_of_a_tracker_have_names_of_their_own(tmp_path):
    data = recorded()
    last = data.rindex(struct.pack(">ii3d", 0, 0, *SWING[-1, 1:]))
    other = data[:last] + struct.pack(">ii", 2, 2) + data[last + 8 :]
    with replayed(other, greeting=COOKIE) as port, pytest.raises(HardwareError, match="it streams cup, cup:2"):
        open_demonstrators(vrpn_settings(tmp_path, port, body="hand"))


def test_the_real_server_streams_a_swing(tmp_path):
    udp_port = free_port(socket.SOCK_DGRAM)
    with vrpn_server(tmp_path, f"vrpn_Tracker_JsonNet cup {udp_port}\n") as port:
        swing_by_json(udp_port, wait_s=0.5)
        (hand,) = open_demonstrators(vrpn_settings(tmp_path, port, seconds=float(SWING[-1, 0]) - 0.05))
    assert far_from_swing(hand) < 0.04


def test_the_real_servers_resting_tracker_is_no_swing(tmp_path):
    with (
        vrpn_server(tmp_path, "vrpn_Tracker_NULL cup 2 100.0\n") as port,
        pytest.raises(InputError, match=r"the swing extends over 0 m; .*; look at capture\.unit \(m\)"),
    ):
        open_demonstrators(vrpn_settings(tmp_path, port, seconds=0.5))
    assert len((tmp_path / "kept.csv").read_text().splitlines()) > 20
