from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from kendama_cli.adaptation.time_scaling import (
    CENTRED_M,
    TauRange,
    TauTrial,
    bracket_tau,
    catch_windows,
    next_grid_tau,
    next_tau,
    next_window_tau,
)

WHERE = TauRange(low=0.8, high=1.2, start=1.0, step=0.02, resolution=0.0005)

Miss = Callable[[float], float | None]


def _search(miss: Miss, *, radius_m: float = 0.02, maximum: int = 80) -> list[TauTrial]:
    trials: list[TauTrial] = []
    while len(trials) < maximum and not any(trial.caught for trial in trials):
        tau = next_tau(trials, WHERE)
        if tau is None:
            break
        value = miss(tau)
        trials.append(TauTrial(tau, value, value is not None and abs(value) < radius_m))
    return trials


@pytest.mark.parametrize("root", [0.81, 0.87, 0.95, 1.003, 1.04, 1.13, 1.19])
@pytest.mark.parametrize("slope", [-5.0, 5.0])
def test_a_catch_of_a_straight_miss_is_found_in_few_rollouts(root: float, slope: float) -> None:
    trials = _search(lambda tau: slope * (tau - root))
    assert trials[-1].caught
    assert len(trials) <= 6


def test_the_measured_shape_of_a_recorded_swing_is_caught_in_four_rollouts() -> None:
    """Two windows, as a person's swing has them: a valley of misses between two zeros."""
    trials = _search(lambda tau: -0.15 + 28 * (tau - 0.97) ** 2)
    assert trials[-1].caught
    assert len(trials) <= 4


def test_a_narrow_window_is_cut_out_of_its_bracket() -> None:
    trials = _search(lambda tau: math.tanh(40 * (tau - 1.0523)) * 0.2, radius_m=0.001)
    assert trials[-1].caught


def test_where_the_ball_never_comes_down_the_whole_grid_is_visited_and_then_nothing_is_left() -> None:
    trials = _search(lambda tau: None)
    assert sorted(round(trial.tau_scale, 3) for trial in trials) == [round(0.8 + 0.02 * k, 3) for k in range(21)]
    assert next_tau(trials, WHERE) is None


def test_two_trials_are_cut_by_the_secant_or_followed_outwards_by_it() -> None:
    """Cut between a tenth and nine of their gap, followed by three steps at most: by numpy's root of their line.

    Too near or too far apart, or with a jump between them, they tell nothing, and the grid is next.
    """
    rng, kinds = np.random.default_rng(10006), []
    for _ in range(400):
        gap = float(rng.choice([0.0004, 0.0006, 0.03, 0.0799, 0.0801])) * rng.choice([-1.0, 1.0])
        old, (m0, m1) = rng.uniform(0.85, 1.15), rng.uniform(-0.35, 0.35, 2)
        lost = rng.random(2) < 0.85
        new, near = old + gap, abs(gap) < 0.08
        trials = [TauTrial(old, m0, not lost[0]), TauTrial(new, m1, not lost[1])]
        root = old + gap * m0 / (m0 - m1)
        inside = lost.all() and m0 * m1 < 0.0 and abs(m0 - m1) < 0.5 and abs(gap) > 0.0005 and near
        cut = np.clip(root, min(old, new) + 0.1 * abs(gap), max(old, new) - 0.1 * abs(gap)) if inside else None
        assert bracket_tau(trials, WHERE) == (None if cut is None else pytest.approx(cut))
        beyond = new + np.clip(root - new, -0.06, 0.06)
        if cut is None and near and 0.8 <= beyond <= 1.2 and min(abs(beyond - old), abs(beyond - new)) >= 0.01:
            kinds.append("beyond")
            assert next_tau(trials, WHERE) == pytest.approx(beyond)
        else:
            kinds.append("cut" if inside else "grid")
            assert next_tau(trials, WHERE) == (pytest.approx(cut) if inside else next_grid_tau(trials, WHERE))
    assert min(kinds.count(kind) for kind in ("cut", "beyond", "grid")) > 40


def test_the_bracket_nearest_to_a_catch_is_cut_and_one_without_a_miss_is_none() -> None:
    misses = ((0.9, 0.2), (0.95, -0.2), (1.0, 0.1), (1.05, -0.3), (1.1, None))
    trials = [TauTrial(tau, miss, False) for tau, miss in misses]
    assert bracket_tau(trials, WHERE) == pytest.approx(0.95 + 0.05 * 2 / 3)
    assert bracket_tau(trials[3:], WHERE) is None


def test_nothing_outside_the_range_is_tried() -> None:
    for slope in (-30.0, 0.5, 30.0):
        for trial in _search(lambda tau, slope=slope: slope * (tau - 2.0)):  # type: ignore[misc]
            assert WHERE.low - 1e-9 <= trial.tau_scale <= WHERE.high + 1e-9


@pytest.mark.parametrize("start", [1.0, 0.843, 1.2])
def test_the_grid_is_visited_from_the_start_outwards(start: float) -> None:
    """The point of the range nearest to the start that is half a step from all trials; the higher one first."""
    where, rng = dataclasses.replace(WHERE, start=start), np.random.default_rng(10007)
    points = [k for k in range(-40, 41) if k and 0.8 - 1e-9 <= start + 0.02 * k <= 1.2 + 1e-9]
    points.sort(key=lambda k: (abs(k), -k))
    for count in (1, 5, 20, 60, 200):
        trials = [TauTrial(tau, None, False) for tau in rng.uniform(0.8, 1.2, count)]
        free = [k for k in points if all(abs(one.tau_scale - start - 0.02 * k) >= 0.01 for one in trials)]
        assert next_grid_tau(trials, where) == (pytest.approx(start + 0.02 * free[0]) if free else None)


@pytest.mark.parametrize(
    ("misses", "centre"),
    [
        ({0.96: -0.06, 1.0: 0.06}, 0.98),
        ({0.96: -0.04, 1.0: 0.06}, 0.976),
        ({0.96: -0.06, 1.041: 0.06}, None),  # too far apart for a line
        ({0.96: -0.3, 1.0: 0.21}, None),  # a jump
        ({0.96: -0.29, 1.0: 0.2}, 0.96 + 0.04 * 29 / 49),
        ({0.96: -0.06, 0.9803: 0.0059, 1.0: 0.06}, None),  # centred well enough
        ({0.96: -0.06, 0.9803: -0.0065, 1.0: 0.06}, 0.9822),
        ({0.96: -0.06, 0.97: None, 1.0: 0.06}, None),  # it did not come down between the two
        ({0.96: -0.06, 0.971: -0.029, 0.975: -0.015, 0.985: 0.015, 0.989: 0.029, 1.0: 0.06}, None),  # four are enough
        ({0.96: -0.06, 0.975: -0.015, 0.985: 0.015, 0.989: 0.029, 1.0: 0.06}, 0.98),
    ],
)
def test_the_centre_of_a_stretch_within_the_mouth_is_tried_next(
    misses: dict[float, float | None], centre: float | None
) -> None:
    """A shift of 30 mm is tried where the curve through the misses is zero; else the grid is next."""
    trials = [TauTrial(tau, miss, abs(miss or 1.0) < 0.03) for tau, miss in misses.items()]
    wanted = next_grid_tau(trials, WHERE) if centre is None else pytest.approx(centre, abs=0.0006)
    assert next_window_tau(trials, WHERE, 0.03) == wanted


def _explore(miss: Miss, mouth_m: float = 0.035, step: float = 0.03) -> list[TauTrial]:
    where = dataclasses.replace(WHERE, step=step)
    trials: list[TauTrial] = []
    while len(trials) < 60:
        found = any(trial.caught for trial in trials)
        tau = next_window_tau(trials, where, mouth_m) if found else next_tau(trials, where)
        if tau is None:
            break
        value = miss(tau)
        trials.append(TauTrial(tau, value, value is not None and abs(value) < mouth_m))
    return trials


@pytest.mark.parametrize("shift", [-0.02, -0.01, 0.0, 0.007, 0.015])
def test_both_windows_of_a_valley_are_found_and_centred_in_few_rollouts(shift: float) -> None:
    def miss(tau: float) -> float:
        return -0.15 + 28 * (tau - 0.97 - shift) ** 2

    where = dataclasses.replace(WHERE, step=0.03)
    trials = _explore(miss)
    windows = catch_windows(trials, where, 0.035)
    assert len(windows) == 2
    for window, sign in zip(sorted(windows, key=lambda one: one.low), (-1, 1), strict=True):
        root = 0.97 + shift + sign * math.sqrt(0.15 / 28)
        edges = sorted(0.97 + shift + sign * math.sqrt((0.15 + edge) / 28) for edge in (-0.035, 0.035))
        assert abs(window.best.tau_scale - root) < CENTRED_M / 4
        # the curve through a parabola's points 0.03 apart is 0.002 off in tau at its edges
        assert [window.low, window.high] == pytest.approx(edges, abs=0.003)
    assert len(trials) <= 14 + 3 * 2


def test_a_window_where_the_miss_only_touches_zero_is_found_between_the_points_of_the_grid() -> None:
    """No change of sign tells of it: the curve through the misses does."""
    trials = _explore(lambda tau: 0.01 + 60 * (tau - 1.075) ** 2 if tau > 1.02 else 0.19 + 2 * (1.02 - tau))
    windows = catch_windows(trials, dataclasses.replace(WHERE, step=0.03), 0.035)
    assert len(windows) == 1
    assert windows[0].best.tau_scale == pytest.approx(1.075, abs=0.004)


def test_a_missed_rollout_parts_two_windows_and_a_window_without_a_catch_is_none() -> None:
    def trials(center: bool) -> list[TauTrial]:
        misses = {0.97: -0.08, 0.99: -0.02, 1.0: 0.0, 1.01: 0.02, 1.03: 0.08}
        return [TauTrial(tau, miss, abs(miss) < 0.03 and (tau != 1.0 or center)) for tau, miss in misses.items()]

    assert len(catch_windows(trials(True), WHERE, 0.03)) == 1
    assert len(catch_windows(trials(False), WHERE, 0.03)) == 2
    assert catch_windows([TauTrial(0.99, -0.02, False), TauTrial(1.01, 0.02, False)], WHERE, 0.03) == ()


def test_windows_come_widest_first() -> None:
    windows = catch_windows(_explore(lambda tau: 100 * (tau - 0.85) * (tau - 1.0) * (1.3 - tau)), WHERE, 0.035)
    widths = [window.high - window.low for window in windows]
    assert len(windows) == 2
    assert widths[0] > widths[1] + 0.001
    assert windows[0].low > windows[1].high


def test_a_jump_between_two_ways_of_coming_down_is_no_window() -> None:
    trials = _explore(lambda tau: 0.3 if tau < 1.007 else -0.3)
    assert catch_windows(trials, WHERE, 0.035) == ()


def test_two_catches_are_of_one_window_until_a_miss_is_seen_between_them() -> None:
    """They lie too far apart for a curve through both, so that nothing is known of what lies between."""
    caught = [TauTrial(0.9, 0.01, True), TauTrial(1.1, -0.01, True)]
    lost = TauTrial(1.0, 0.3, False)
    for trials, ends in ((caught, [(0.9, 1.1)]), ([*caught, lost], [(0.9, 0.9), (1.1, 1.1)])):
        found = sorted((window.low, window.high) for window in catch_windows(trials, WHERE, 0.038))
        assert len(found) == len(ends)
        assert sum(found, ()) == pytest.approx(sum(ends, ()), abs=1e-4)
