"""Trackers and recorders of different rates, clocks and habits: the swing that comes out is the one that was made."""

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.errors import InputError
from tests.devices.demonstrator.files import file_settings, write
from tests.motion.swings import path

HEAD = "t_s,x_m,y_m,z_m"
AXES = {"plausible": {"axes": "off"}}


def lines(t_s, place_m, form="{:.6f}"):
    return [HEAD, *(",".join([form.format(t), *(f"{v:.5f}" for v in p)]) for t, p in zip(t_s, place_m, strict=True))]


def read(file, **changes):
    (hand,) = open_files(file_settings(file, **{**AXES, **changes}))
    samples = list(hand.samples())
    made = np.array([one.t_s for one in samples]), np.array([one.position_m for one in samples])
    return *made, " ".join(hand.warnings)


def off_mm(t_s, place_m, duration_s=1.2, began_s=0.3):
    """The largest distance from the swing's formula, at the shift in time that fits best."""
    shifts = np.linspace(-0.02, 0.02, 81)
    away = [np.linalg.norm(path(t_s + shift - began_s, duration_s) - place_m, axis=1).max() for shift in shifts]
    return 1e3 * min(away)


@pytest.mark.parametrize("logged_hz", [90, 100, 120, 144, 240, 1000])
@pytest.mark.parametrize("tracker_hz", [30, 50, 59.94, 60])
def test_a_tracker_whose_positions_are_logged_again_gives_each_once(tmp_path, tracker_hz, logged_hz):
    t_s = np.arange(0, 1.9, 1 / logged_hz)
    seen_s = np.floor((t_s + 0.004) * tracker_hz) / tracker_hz
    made_s, made_m, told = read(write(tmp_path / "a.csv", lines(t_s, path(seen_s - 0.3, 1.2))))
    assert 1 / np.median(np.diff(made_s)) == pytest.approx(tracker_hz, rel=0.01)
    assert off_mm(made_s, made_m) < 3
    assert "of the rows of the moving hand repeat the position before: the tracker delivers" in told


@pytest.mark.parametrize("rate_hz", [30, 60, 100, 240])
def test_a_swing_of_its_own_rate_is_left_as_it_is(tmp_path, rate_hz):
    """Rounded to a millimetre, so that a slow hand has one place for many samples."""
    t_s = np.arange(0, 1.9, 1 / rate_hz)
    made_s, made_m, told = read(write(tmp_path / "a.csv", lines(t_s, path(t_s - 0.3, 1.2).round(3))))
    assert made_s == pytest.approx(t_s, abs=1e-6)
    assert len(made_m) == len(t_s)
    assert "repeat" not in told


def test_rows_that_repeat_to_the_digit_are_taken_once(tmp_path):
    t_s = np.arange(0, 1.9, 0.01)
    rows = lines(t_s, path(t_s - 0.3, 1.2))
    twice = [rows[0], *(row for i, row in enumerate(rows[1:]) for row in [row] * (1 + i % 2))]
    made_s, made_m, told = read(write(tmp_path / "a.csv", twice))
    assert made_s == pytest.approx(t_s, abs=1e-9)
    assert made_m == pytest.approx(path(t_s - 0.3, 1.2), abs=1e-5)
    assert "used once: 95 rows like an earlier one to the digit" in told
    appended = read(write(tmp_path / "b.csv", [*rows, *rows[1:]]))
    assert appended[0] == pytest.approx(t_s, abs=1e-9)


def test_two_positions_at_one_time_are_no_repeated_row(tmp_path):
    rows = lines(np.repeat(np.arange(0, 1.9, 0.02), 2), path(np.arange(0, 1.9, 0.01) - 0.3, 1.2))
    made_s, made_m, told = read(write(tmp_path / "a.csv", rows))
    assert off_mm(made_s, made_m) < 1
    assert "stamps stray by up to 5.1 ms from a steady 100.0 Hz" in told


@pytest.mark.parametrize("seed", [10300, 10301, 10302])
@pytest.mark.parametrize("strays_s", [0.002, 0.004, 0.015])
def test_stamps_of_arrival_are_put_back_to_the_steady_rate(tmp_path, strays_s, seed):
    """The tracker sees every 10 ms, its stamps are late by up to 15 ms: neighbours may even change places in time."""
    t_s = np.arange(0, 1.9, 0.01)
    late_s = np.random.default_rng(seed).uniform(0, strays_s, len(t_s))
    file = write(tmp_path / "a.csv", lines(t_s + late_s, path(t_s - 0.3, 1.2)))
    made_s, made_m, told = read(file)
    assert off_mm(made_s, made_m) < 1
    assert "whose times are taken (capture.times=stamps keeps them)" in told


@pytest.mark.parametrize("seed", [10310, 10311])
def test_stamps_that_are_right_though_uneven_are_kept(tmp_path, seed):
    """A tracker that truly sees at uneven times: with even ones the swing would be rough."""
    even_s = np.arange(0, 1.9, 0.01)
    t_s = even_s + np.random.default_rng(seed).uniform(-0.003, 0.003, len(even_s))
    made_s, made_m, told = read(write(tmp_path / "a.csv", lines(t_s, path(t_s - 0.3, 1.2))))
    assert made_s == pytest.approx(t_s - t_s[0], abs=2e-6)
    assert off_mm(made_s, made_m) < 0.3  # the shifts that are tried are 0.5 ms apart
    assert "stray" not in told


def test_stamps_are_kept_where_the_settings_say_so(tmp_path):
    t_s = np.arange(0, 1.9, 0.01)
    late_s = np.random.default_rng(10320).uniform(0, 0.002, len(t_s))
    made_s, _, _ = read(write(tmp_path / "a.csv", lines(t_s + late_s, path(t_s - 0.3, 1.2))), times="stamps")
    assert made_s == pytest.approx(t_s + late_s - late_s[0], abs=2e-6)


def test_rows_out_of_order_are_refused(tmp_path):
    t_s = np.arange(0, 1.9, 0.01)
    rows = lines(t_s, path(t_s - 0.3, 1.2))
    rows[60], rows[90] = rows[90], rows[60]
    with pytest.raises(InputError, match=r"line 62: time does not rise: 0\.6 s after 0\.89 s"):
        open_files(file_settings(write(tmp_path / "a.csv", rows)))


def test_a_frozen_tracker_is_still_refused(tmp_path):
    t_s = np.arange(0, 1.9, 0.01)
    place_m = path(t_s - 0.3, 1.2)
    place_m[70:80] = place_m[70]
    with pytest.raises(InputError, match="the same position for 90 ms"):
        open_files(file_settings(write(tmp_path / "a.csv", lines(t_s, place_m)), **AXES))
