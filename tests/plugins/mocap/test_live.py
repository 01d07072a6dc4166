"""A live stream by OpenIGTLink from pyigtl's server: recorded, kept, and told where it stutters, lies or goes away."""

from __future__ import annotations

import socket
import threading
import time

import numpy as np
import pytest
import yaml

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import ConfigError, HardwareError, InputError
from kendama_cli.plugins.mocap.settings import MocapCapture
from kendama_cli.schema.settings import build
from tests.plugins.stalls import without_stall
from tests.plugins.swing_server import ROOT, SWING, at_its_pace, free_port

pytestmark = pytest.mark.realtime

pyigtl = pytest.importorskip("pyigtl")


def settings(tmp_path, port, **changes):
    data = yaml.safe_load((ROOT / "conf/capture/mocap.yaml").read_text())
    return build(
        MocapCapture, data | {"port": port, "record": str(tmp_path / "kept.csv"), "seconds": 2.5} | changes, "capture"
    )


@pytest.fixture
def streamed():
    """Streams a bundled swing at its own pace until its end; ``change`` may alter each pose."""
    running = []

    def start(change=lambda i, matrix: matrix, name="cup", stamp=lambda t_s: t_s):
        port = free_port()
        server = pyigtl.OpenIGTLinkServer(port=port, local_server=True)
        running.append(server)
        began = time.time()

        def send(i, row):
            matrix = np.eye(4)
            matrix[:3, 3] = 1e3 * row[1:]
            matrix = change(i, matrix)
            if matrix is not None:
                message = pyigtl.TransformMessage(matrix, device_name=name, timestamp=stamp(began + row[0]))
                server.send_message(message, wait=False)

        def run():
            while not server.is_connected():
                time.sleep(0.005)
            at_its_pace(send)

        threading.Thread(target=run, daemon=True).start()
        return port, SWING

    yield start
    for server in running:
        server.stop()


def test_every_pose_of_a_stream_arrives_and_is_kept(streamed, tmp_path):
    def recorded(attempt):
        kept = tmp_path / f"kept-{attempt}.csv"
        port, rows = streamed()
        told = []
        chosen = settings(tmp_path, port, record=str(kept))
        (hand,) = open_demonstrators(chosen, lambda done, total, **figures: told.append((done, total, figures)))
        samples = list(hand.samples())
        assert [done for done, _, _ in told] == sorted(done for done, _, _ in told), "live, while it is recorded"
        assert told[-1][:2] in ((1, 3), (2, 3))
        assert told[-1][2]["rate_hz"] == pytest.approx(100.0, rel=0.1)
        assert {"gaps", "longest_step_ms", "delay_ms"} <= told[-1][2].keys()
        made = np.array([one.position_m for one in samples])
        truth = np.column_stack([np.interp([one.t_s for one in samples], rows[:, 0], c) for c in rows[:, 1:].T])
        assert np.abs(made - made[0] - truth + truth[0]).max() < 2e-3  # the first poses may come before we listen
        assert len(samples) > 230
        assert any("poses at 100.0 Hz" in one and "delay" in one for one in hand.warnings)
        assert len(kept.read_text().splitlines()) == len(samples) + 2
        with pytest.raises(ConfigError, match="which exists; a recording is never overwritten"):
            open_demonstrators(chosen)

    without_stall(recorded, AssertionError, InputError)  # a server that stands still leaves out poses


def test_poses_that_are_no_numbers_are_left_out_and_told(streamed, tmp_path):
    port, _ = streamed(lambda i, matrix: matrix * np.nan if i in (60, 61) else matrix)
    (hand,) = open_demonstrators(settings(tmp_path, port))
    assert any("2 poses were not finite numbers" in one for one in hand.warnings)


def test_a_body_of_another_name_is_told_with_what_is_streamed(streamed, tmp_path):
    port, _ = streamed(name="stylus")
    with pytest.raises(HardwareError, match="it streams stylus"):
        open_demonstrators(settings(tmp_path, port))
    assert not (tmp_path / "kept.csv").exists()


def test_a_server_that_goes_silent_leaves_what_came(streamed, tmp_path):
    port, _ = streamed(lambda i, matrix: matrix if i < 230 else None)
    (hand,) = open_demonstrators(settings(tmp_path, port, seconds=30.0))
    assert any("has been silent for 3 s" in one and "what came before is kept" in one for one in hand.warnings)


def test_a_server_that_is_not_there(tmp_path):
    with pytest.raises(HardwareError, match=r"is not there .*; look at capture\.host, capture\.port"):
        open_demonstrators(settings(tmp_path, free_port()))


def test_a_server_without_times_is_taken_by_arrival_at_a_steady_rate(streamed, tmp_path):
    """As the example servers of the OpenIGTLink project are."""

    def recorded(attempt):
        port, _ = streamed(stamp=lambda t_s: 0.0)
        return open_demonstrators(settings(tmp_path, port, record=str(tmp_path / f"kept-{attempt}.csv")))

    (hand,) = without_stall(recorded, InputError)  # a server that stands still leaves out poses
    assert any("the server sends no times: those of arrival are taken" in one for one in hand.warnings)
    t_s = np.array([one.t_s for one in hand.samples()])
    assert t_s[-1] == pytest.approx(SWING[-1, 0], abs=0.3)


def test_another_protocol_is_told(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=lambda: server.accept()[0].sendall(b"HTTP/1.1 400 Bad Request\r\n" * 9)).start()
        with pytest.raises(HardwareError, match=r"does not speak OpenIGTLink .*capture\.protocol"):
            open_demonstrators(settings(tmp_path, server.getsockname()[1]))
