"""Recordings that are well-formed and wrong: each is told in one line, and none that a person made is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.errors import InputError
from tests.devices.demonstrator.files import file_settings

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def swing():
    """Times and places of a bundled swing."""
    rows = np.loadtxt(ROOT / "data" / "demonstrations" / "swing-01.csv", delimiter=",", comments=("#", "t"))
    return rows[:, 0], rows[:, 1:]


def opened(folder, t_s, place_m, **changes):
    rows = [f"{t:.4f},{x:.5f},{y:.5f},{z:.5f}" for t, (x, y, z) in zip(t_s, place_m, strict=True)]
    path = folder / "swing.csv"
    path.write_text("\n".join(["t_s,x_m,y_m,z_m", *rows]) + "\n")
    return open_files(file_settings(path, **changes))


def refusal(folder, t_s, place_m, **changes):
    with pytest.raises(InputError) as caught:
        opened(folder, t_s, place_m, **changes)
    assert "\n" not in str(caught.value)
    assert caught.value.remedy
    return str(caught.value)


def test_a_tracker_that_was_frozen_for_100_ms(tmp_path, swing):
    t_s, place_m = swing
    frozen = place_m.copy()
    frozen[121:131] = frozen[120]
    told = refusal(tmp_path, t_s, frozen)
    assert "line 122: the same position for 100 ms (11 samples) amid the motion" in told
    assert "the tracker was frozen there" in told


def test_rows_missing_under_regular_stamps(tmp_path, swing):
    t_s, place_m = swing
    cut = np.delete(place_m, np.s_[120:128], axis=0)
    told = refusal(tmp_path, t_s[: len(cut)], cut)
    assert "an acceleration of" in told
    assert "line 122" in told or "line 121" in told
    assert "a hand reaches 150; rows are missing" in told


def test_a_few_missing_rows_are_a_doubt_reported_with_the_line(tmp_path, swing):
    t_s, place_m = swing
    cut = np.delete(place_m, np.s_[120:121], axis=0)
    (hand,) = opened(tmp_path, t_s[: len(cut)], cut)
    assert any("rows missing?" in one and "line 12" in one for one in hand.warnings)


def test_a_whole_swing_gives_no_doubt(tmp_path, swing):
    (hand,) = opened(tmp_path, *swing)
    assert hand.warnings == ()


def test_a_fragment_of_a_swing(tmp_path, swing):
    t_s, place_m = swing
    assert "it lasts 0.29 s; a swing from the hanging ball to the catch takes" in refusal(
        tmp_path, t_s[:30], place_m[120:150]
    )


def test_a_recording_that_begins_amid_the_motion_is_reported(tmp_path, swing):
    t_s, place_m = swing
    (hand,) = opened(tmp_path, t_s[: len(t_s) - 110], place_m[110:])
    assert any("where it begins" in one for one in hand.warnings)


@pytest.mark.parametrize(
    ("axes", "signs", "told"),
    [
        ([0, 1, 2], [1, 1, -1], "with -z upward"),
        ([0, 2, 1], [1, 1, 1], "with y upward"),
        ([2, 1, 0], [1, 1, 1], "with x upward"),
    ],
)
def test_axes_under_which_it_is_no_swing_are_reported_with_what_to_change(tmp_path, swing, axes, signs, told):
    t_s, place_m = swing
    turned = place_m[:, axes] * signs
    line = refusal(tmp_path, t_s, turned)
    assert told in line
    assert "capture.columns and capture.sign" in line
    assert "capture.plausible.axes=warn" in line
    (hand,) = opened(tmp_path, t_s, turned, plausible={"axes": "warn"})
    assert any(told in one for one in hand.warnings)


@pytest.mark.parametrize("degrees", [0, 5, 10, 20, 41, 60, 89])
def test_a_rotated_swing_plane_is_reported_and_used(tmp_path, swing, degrees):
    t_s, place_m = swing
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    (hand,) = opened(tmp_path, t_s, place_m @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    told = [int(found[1]) for one in hand.warnings if (found := re.search(r"turned by (\d+) deg from x", one))]
    assert told == ([pytest.approx(degrees, abs=2)] if degrees > 8 else [])


@pytest.mark.parametrize(
    ("factor", "told"), [(2.0, "half as long: recorded at twice"), (0.5, "twice as long: at half")]
)
def test_a_rate_that_is_wrong_by_two_is_reported_as_that(tmp_path, swing, factor, told):
    t_s, place_m = swing
    (hand,) = opened(tmp_path, factor * t_s, place_m)
    assert any(f"never rises over the cup, but it does with times {told} the rate?" in one for one in hand.warnings)


def test_the_return_is_left_out_and_reported(tmp_path, swing):
    place_m = swing[1]
    wait = np.repeat(place_m[-1:], 60, axis=0)
    u = np.linspace(0, 1, 300)[:, None]
    back = place_m[-1] + (place_m[0] - place_m[-1]) * u**2 * (3 - 2 * u)
    whole = np.vstack((place_m, wait, back))
    hands = opened(tmp_path, np.arange(len(whole)) / 100, whole)
    assert [hand.name for hand in hands] == ["swing"]
    assert "left out: " in hands[0].warnings[0]
    assert sum(1 for _ in hands[0].samples()) < len(place_m) + 30


def test_several_swings_in_one_file_are_cut_apart(tmp_path, swing):
    _, place_m = swing
    u = np.linspace(0, 1, 200)[:, None]
    back = place_m[-1] + (place_m[0] - place_m[-1]) * u**2 * (3 - 2 * u)
    once = np.vstack((place_m, np.repeat(place_m[-1:], 80, axis=0), back, np.repeat(place_m[:1], 80, axis=0)))
    whole = np.vstack((once, once, place_m))
    hands = opened(tmp_path, np.arange(len(whole)) / 100, whole)
    assert [hand.name for hand in hands] == ["swing-1", "swing-2", "swing-3"]
    for hand in hands:
        samples = np.array([one.position_m for one in hand.samples()])
        assert np.ptp(samples, axis=0) == pytest.approx(np.ptp(place_m, axis=0), abs=0.002)
    (one,) = opened(tmp_path, np.arange(len(whole)) / 100, whole, segments="one")
    assert sum(1 for _ in one.samples()) == len(whole)


def test_a_return_as_fast_as_the_swing_is_left_out_and_reported(tmp_path, swing):
    place_m = swing[1]
    whole = np.vstack((place_m, np.repeat(place_m[-1:], 80, axis=0), place_m[::-1]))
    (hand,) = opened(tmp_path, np.arange(len(whole)) / 100, whole)
    assert np.ptp([one.position_m for one in hand.samples()], axis=0) == pytest.approx(
        np.ptp(place_m, axis=0), abs=0.02
    )
    assert any("with which a ball never rises over the cup, as it does elsewhere" in one for one in hand.warnings)


def test_two_jumps_and_no_swing(tmp_path):
    """Both are shorter than a swing, so that nothing of the recording would be left."""
    t_s = np.arange(0, 3, 0.01)
    place_m = np.column_stack([np.where(t_s < 1, 0.0, 0.5), np.zeros(300), np.where(t_s < 2, 1.0, 1.2)])
    assert re.search(r"jump|speed|acceleration", refusal(tmp_path, t_s, place_m))


def test_a_pause_within_a_swing_does_not_cut_it(tmp_path, swing):
    """The hand holds still for 0.5 s while the ball flies, then moves a little under it."""
    place_m = swing[1]
    pull = place_m[:60]
    u = np.linspace(0, 1, 25)[:, None]
    up = pull[-1] + np.array([0.0, 0.0, 0.35]) * u**3 * (10 - 15 * u + 6 * u**2)
    small = up[-1] + np.array([0.05, 0.0, -0.1]) * u**3 * (10 - 15 * u + 6 * u**2)
    whole = np.vstack(
        (np.repeat(pull[-1:], 40, axis=0), up, np.repeat(up[-1:], 50, axis=0), small, np.repeat(small[-1:], 30, axis=0))
    )
    assert len(opened(tmp_path, np.arange(len(whole)) / 100, whole)) == 1


def test_no_bundled_demonstration_is_doubted():
    hands = open_files(file_settings(sorted((ROOT / "data" / "demonstrations").glob("*.csv"))))
    assert len(hands) == 12
    assert [hand.warnings for hand in hands] == [()] * 12


def test_a_persons_recording_passes_whole_and_loses_its_return(recordings):
    path = recordings / "li-kendama" / "kendama1-20.txt"
    (play,) = open_files(file_settings(path, "iiwa_kendama"))
    (whole,) = open_files(file_settings(path, "iiwa_kendama", last_row=None))
    assert len(list(play.samples())) == 350
    assert 340 <= len(list(whole.samples())) <= 380
    assert "left out: " in whole.warnings[0]
