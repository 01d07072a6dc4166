"""Paths in the swing plane and the numbers that captions give."""

import numpy as np
import pandas as pd
import pytest

from kendama_cli.report.tables import label_and_unit, number
from kendama_cli.report.tracks import Path2D, catch_time_s, direction, last_start_s, running_median, track
from tests.simulation.dart.bench_robot import kendama_game

CUP = kendama_game().cup


def _frame(t, x, y, z, q=(1.0, 0.0, 0.0, 0.0)):
    columns = {"t_s": t, "x_m": x, "y_m": y, "z_m": z}
    return pd.DataFrame(
        {**columns, **{name: np.full(len(t), v) for name, v in zip(("qw", "qx", "qy", "qz"), q, strict=True)}}
    )


@pytest.mark.parametrize("heading_deg", [0.0, 40.0, 90.0, 130.0])
def test_a_swing_in_any_vertical_plane_shows_its_full_width(heading_deg):
    s = np.sin(np.linspace(0, 6, 200))
    heading = np.radians(heading_deg)
    frame = _frame(np.linspace(0, 1, 200), s * np.cos(heading), s * np.sin(heading), 0 * s)
    shown = track(frame, direction(frame))
    assert np.ptp(shown.x_m) == pytest.approx(np.ptp(s), rel=1e-9)


def test_the_tilt_is_that_of_the_cups_axis_in_the_plane():
    half = np.radians(30) / 2
    frame = _frame(np.array([0.0, 1.0]), np.zeros(2), np.zeros(2), np.zeros(2), (np.cos(half), 0.0, np.sin(half), 0.0))
    assert np.degrees(track(frame).tilt_rad) == pytest.approx([30, 30])


def test_long_paths_are_thinned_but_keep_their_times():
    t = np.arange(0, 60, 0.001)
    shown = track(_frame(t, t, 0 * t, 0 * t))
    assert len(shown.t_s) <= 1501
    assert np.array_equal(shown.t_s, shown.x_m)


def test_the_catch_is_the_fall_through_the_rim_within_reach():
    t = np.linspace(0, 2, 2001)
    rest = Path2D(t, 0 * t, 0 * t, 0 * t)
    height = 0.07 + 0.3 - 0.5 * 9.81 * (t - 1) ** 2
    ball = Path2D(t, 0.02 + 0 * t, height, 0 * t)
    assert catch_time_s(rest, ball, CUP) == pytest.approx(1 + np.sqrt(0.6 / 9.81), abs=1e-3)
    assert catch_time_s(rest, ball.moved(0.3, 0.0), CUP) is None
    assert catch_time_s(rest, ball.moved(0.0, -0.4), CUP) is None


def test_attempts_are_parted_by_jumps():
    t = np.arange(0, 1, 0.01)
    one = _frame(t, 0 * t, 0 * t, 0 * t)
    two = _frame(t + 1, 0 * t + 0.4, 0 * t, 0 * t)
    assert last_start_s(pd.concat([one, two])) == t[-1]
    assert last_start_s(one) == -np.inf


def test_the_running_median_ignores_a_single_outlier():
    values = np.ones(50)
    values[20] = -1000
    assert np.array_equal(running_median(values, 5), np.ones(50))


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("position_error_mm_p50", ("position error, median", "mm")),
        ("n_demonstrations", ("number of demonstrations", "")),
        ("peak_speed_m_s", ("peak speed", "m/s")),
        ("success_rate", ("success rate", "")),
        ("gravity_m_s2", ("gravity", "m/s²")),
    ],
)
def test_names_become_words_and_units(name, shown):
    assert label_and_unit(name) == shown


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (True, "yes"),
        (None, "–"),
        (0.123456, "0.1235"),
        (-2.0, "−2"),
        (123456.0, "123456"),
        ([1, 2.5], "1, 2.5"),
        (7, "7"),
    ],
)
def test_numbers_read_as_in_print(value, shown):
    assert number(value) == shown
