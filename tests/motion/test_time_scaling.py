from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from kendama_cli.motion.time_scaling import TauRange, Trial, bracket_tau, catch_windows, next_grid_tau, next_tau

WHERE = TauRange(low=0.8, high=1.2, start=1.0, step=0.02, resolution=0.0005)

Miss = Callable[[float], float | None]


def _search(miss: Miss, *, radius_m: float = 0.02, most: int = 80) -> list[Trial]:
    trials: list[Trial] = []
    while len(trials) < most and not any(trial.caught for trial in trials):
        tau = next_tau(trials, WHERE)
        if tau is None:
            break
        value = miss(tau)
        trials.append(Trial(tau, value, value is not None and abs(value) < radius_m))
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


def test_a_jump_between_two_ways_of_coming_down_is_no_catch() -> None:
    trials = [Trial(1.0, 0.4, False), Trial(1.02, -0.4, False)]
    assert bracket_tau(trials, WHERE) is None


def test_nothing_outside_the_range_is_tried() -> None:
    for slope in (-30.0, 0.5, 30.0):
        for trial in _search(lambda tau, slope=slope: slope * (tau - 2.0)):  # type: ignore[misc]
            assert WHERE.low - 1e-9 <= trial.tau_scale <= WHERE.high + 1e-9


def test_the_grid_is_visited_from_the_start_outwards() -> None:
    trials = [Trial(1.0, None, False)]
    for expected in (1.02, 0.98, 1.04, 0.96):
        tau = next_grid_tau(trials, WHERE)
        assert tau == pytest.approx(expected)
        trials.append(Trial(expected, None, False))


def test_windows_are_runs_of_neighbours_that_catch_widest_first() -> None:
    caught = {0.88: False, 0.9: True, 0.92: False, 1.0: True, 1.02: True, 1.04: True, 1.06: False}
    windows = catch_windows([Trial(tau, 0.0, hit) for tau, hit in caught.items()])
    assert [[trial.tau_scale for trial in window] for window in windows] == [[1.0, 1.02, 1.04], [0.9]]
