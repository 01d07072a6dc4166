"""Expected success of what raced."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.adaptation.catch_search import expected_success, mean_distance_m
from kendama_cli.adaptation.perturbed_simulations import Repeat

MOUTH_M = 0.038


def _repeats(misses: np.ndarray) -> list[Repeat]:
    return [Repeat(bool(abs(one) < MOUTH_M), float(one)) for one in misses]


@pytest.mark.parametrize(("middle_m", "spread_m"), [(0.0, 0.01), (0.02, 0.01), (0.0, 0.04), (0.03, 0.02), (0.08, 0.01)])
def test_the_expected_success_is_the_share_of_worlds_that_are_caught(middle_m: float, spread_m: float) -> None:
    """Over 400 judgements by 12 worlds each: within 0.06 on average, one by one as near as counting, or nearer."""
    rng = np.random.default_rng(10000)
    true = float(np.mean(np.abs(rng.normal(middle_m, spread_m, 200_000)) < MOUTH_M))
    judged = [_repeats(rng.normal(middle_m, spread_m, 12)) for _ in range(400)]
    expected = np.array([expected_success(one, MOUTH_M) for one in judged])
    counted = np.array([np.mean([repeat.caught for repeat in one]) for one in judged])
    assert expected.mean() == pytest.approx(true, abs=0.06)
    assert np.mean((expected - true) ** 2) <= 1.2 * np.mean((counted - true) ** 2) + 1e-4


def test_a_few_lost_worlds_far_off_count_as_what_they_are() -> None:
    """A visual catch comes down in the middle, or far away: two of twelve are two of twelve."""
    misses = np.array([0.001, -0.002, 0.0, 0.003, 0.001, -0.001, 0.002, 0.0, -0.003, 0.001, 0.2, -0.15])
    assert expected_success(_repeats(misses), MOUTH_M) == pytest.approx(10 / 12, abs=1e-3)


def test_balls_that_jumped_out_and_balls_that_never_came_down_are_lost() -> None:
    good = [Repeat(True, 0.0)] * 4
    assert expected_success(good, MOUTH_M) == pytest.approx(1.0)
    assert expected_success([*good[:3], Repeat(False, 0.0)], MOUTH_M) == pytest.approx(0.75)
    assert expected_success([*good[:3], Repeat(False, None)], MOUTH_M) == pytest.approx(0.75)
    assert expected_success([Repeat(False, None)] * 4, MOUTH_M) == 0.0
    assert mean_distance_m([Repeat(True, -0.01, 0.03), Repeat(False, None)]) == pytest.approx(0.52)
