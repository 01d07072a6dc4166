"""Live trackers that go away, stutter or lie: one clear line each, and what came is kept, by either protocol."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import ConfigError, HardwareError, InputError
from kendama_cli.plugins.shared.streams.openigtlink import HEADER, TRANSFORM, crc64
from kendama_cli.plugins.shared.streams.stream_server import USUAL_UNIT
from kendama_cli.plugins.shared.streams.vrpn import COOKIE, POSE, POSE_TYPE, SENDER, TYPE, named
from kendama_cli.plugins.shared.streams.vrpn import HEADER as VRPN_HEADER
from kendama_cli.schema.units import METRES
from tests.plugins.mocap.test_live import settings
from tests.plugins.swing_server import SWING, replayed

BEGAN_S = 1_700_000_000.0


def openigtlink_bytes(rows):
    """A TRANSFORM 'cup' for every row (stamp, x, y, z)."""
    made = b""
    for stamp_s, *place in rows.tolist():
        body = TRANSFORM.pack(1, 0, 0, 0, 1, 0, 0, 0, 1, *place)
        made += HEADER.pack(1, b"TRANSFORM", b"cup", round(stamp_s * 2**32), len(body), crc64(body)) + body
    return made


def vrpn_bytes(rows):
    """The names of sender 0 and type 4, and a report for every row."""
    made = COOKIE
    made += named(SENDER, 0, "cup") + named(TYPE, 4, POSE_TYPE)
    for stamp_s, *place in rows.tolist():
        seconds, part_s = divmod(stamp_s, 1)
        made += VRPN_HEADER.pack(88, int(seconds), int(1e6 * part_s), 0, 4, 0) + POSE.pack(0, 0, *place, 0, 0, 0, 1)
    return made


SPOKEN = {"openigtlink": (openigtlink_bytes, b""), "vrpn": (vrpn_bytes, COOKIE)}


@pytest.fixture(params=SPOKEN)
def streamed(request, tmp_path):
    """Opens the hand on these rows (n, 4) of stamp [s] and place [m], sent at once; gives it and what was kept."""

    def opened(rows, **changes):
        write, greeting = SPOKEN[request.param]
        sent = write(rows / [1, *[METRES[USUAL_UNIT[request.param]]] * 3])
        with replayed(sent, greeting=greeting) as port:
            return open_demonstrators(settings(tmp_path, port, protocol=request.param, seconds=60.0, **changes))

    opened.kept, opened.usual_m = tmp_path / "kept.csv", METRES[USUAL_UNIT[request.param]]
    return opened


def swing():
    return SWING + np.array([BEGAN_S, 0, 0, 0])


def kept_rows(streamed):
    return len(streamed.kept.read_text().splitlines()) - 2


def test_a_server_that_goes_away_leaves_what_came(streamed):
    (hand,) = streamed(swing()[:230])
    assert any("the server closed the line after 230 poses; what came before is kept" in one for one in hand.warnings)
    assert kept_rows(streamed) == 230


def test_stutters_are_counted(streamed):
    """Every eleventh pose is late by a few ms or missing: a swing all the same."""
    (hand,) = streamed(np.delete(swing(), np.s_[5::11], axis=0))
    assert any(f"{len(SWING[5::11])} gaps (the longest step 20 ms)" in one for one in hand.warnings)


def missing(rows):
    return np.delete(rows, np.s_[100:120], axis=0)


def frozen(rows):
    at = int(np.linalg.norm(np.diff(rows[:, 1:], axis=0), axis=1).argmax())  # amid the fastest motion
    rows[at - 1 : at + 3, 1:] = rows[at - 1, 1:]
    return rows


def jumping(rows):
    rows[120, 1:] += 0.5
    return rows


def set_back(rows):
    """A clock that is set back by half a second: the poses until then have been seen before."""
    at = int(np.linalg.norm(np.diff(rows[:, 1:], axis=0), axis=1).argmax())
    rows[at:, 0] -= 0.5
    return rows


def set_forward(rows):
    rows[120:, 0] += 0.5
    return rows


def resting(rows):
    rows[:, 1:] = rows[0, 1:]
    return rows


def in_metres_not_millimetres(rows):
    rows[:, 1:] /= 1000
    return rows


@pytest.mark.parametrize(
    ("fault", "words", "rows"),
    [
        (missing, r"'cup' is not seen for 0\.21 s; allowed: 0\.12 s", 237),
        (frozen, "the same position for 30 ms .* amid the motion", 257),
        (jumping, "the position jumps by 0.8", 257),
        (set_back, "(the position jumps by|an acceleration of) ", None),
        (set_forward, r"'cup' is not seen for 0\.51 s", 257),
        (resting, "the swing extends over 0 m", 257),
        (in_metres_not_millimetres, r"the swing extends over 0\.000\d+ m; .*; look at capture\.unit \(m?m\)", 257),
    ],
)
def test_what_no_hand_does_is_refused_in_one_line_and_kept(streamed, fault, words, rows):
    with pytest.raises(InputError, match=words) as told:
        streamed(fault(swing()))
    assert "\n" not in str(told.value)
    assert str(told.value).startswith(str(streamed.kept))
    assert kept_rows(streamed) == rows if rows is not None else 100 < kept_rows(streamed) < 257


def test_places_that_are_no_numbers_are_left_out_and_told(streamed):
    rows = swing()
    rows[60:62, 2] = np.nan
    (hand,) = streamed(rows)
    assert any("2 poses were not finite numbers and are left out" in one for one in hand.warnings)


def test_a_body_that_is_never_seen_is_told(streamed):
    with pytest.raises(HardwareError, match="'cup' is never seen: 257 poses are not finite numbers"):
        streamed(swing() * [1, np.nan, 1, 1])
    assert not streamed.kept.exists()


def test_a_clock_that_differs_from_ours_is_told(streamed):
    (hand,) = streamed(swing())
    assert any("the tracker's clock differs from ours by " in one for one in hand.warnings)


def test_a_clock_that_stands_still_is_told(streamed):
    rows = swing()
    rows[:, 0] = BEGAN_S
    with pytest.raises(HardwareError, match=r"the stamps of 'cup' stand still \(256 poses do not rise\)"):
        streamed(rows)
    assert not streamed.kept.exists()


def test_places_in_another_unit_are_told_before_anybody_swings(streamed):
    """A tracker that counts in mm and is taken to count in m."""
    with pytest.raises(ConfigError, match=r"'cup' is 1108 m from the tracker's origin, .*; 'capture\.unit'"):
        streamed(swing() * [1, 1000, 1000, 1000])
    assert not streamed.kept.exists()


def test_the_unit_can_be_declared(streamed):
    (hand,) = streamed(swing() * [1, *[streamed.usual_m / METRES["cm"]] * 3], unit="cm")
    made = np.array([one.position_m for one in hand.samples()])
    assert made == pytest.approx(SWING[:, 1:], abs=1e-6)
