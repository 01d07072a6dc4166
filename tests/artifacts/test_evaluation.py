"""Evaluations that end early: the coverage of their intervals, and the trials that they save."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy.stats import binomtest

from kendama_cli.artifacts.proportion import Evaluation

RATES = np.linspace(0.005, 0.995, 199)
DRAWS = 40_000


def clopper_pearson(successes: int, played: int) -> tuple[float, float]:
    """Return the 95 % interval of SciPy, as if nothing had ended early."""
    interval = binomtest(successes, played).proportion_ci(method="exact")
    return interval.low, interval.high


def ended(evaluation: Evaluation, rate: float, rng: np.random.Generator) -> dict[tuple[int, int], int]:
    """Return how many of DRAWS evaluations of a true ``rate`` end with so many successes in so many trials."""
    going = {(0, 0): DRAWS}
    ends: dict[tuple[int, int], int] = {}
    while going:
        (successes, played), count = going.popitem()
        ahead = evaluation.to_play(successes, played)
        if not ahead:
            ends[successes, played] = ends.get((successes, played), 0) + count
            continue
        more, counts = np.unique(rng.binomial(ahead, rate, count), return_counts=True)
        for gained, of in zip(more.tolist(), counts.tolist(), strict=True):
            end = (successes + gained, played + ahead)
            going[end] = going.get(end, 0) + of
    return ends


def worst_coverage(planned: int, *, plain: bool) -> float:
    """Return the least fraction of intervals that hold the true rate, over RATES."""
    evaluation, rng, found = Evaluation(planned, thorough=False), np.random.default_rng([43, planned]), []

    @functools.cache
    def interval(successes: int, played: int) -> tuple[float, float]:
        _, low, high = evaluation.figures("rate", successes, played).values()
        assert low is not None
        assert high is not None
        return clopper_pearson(successes, played) if plain else (low, high)

    for rate in RATES.tolist():
        covered = 0
        for end, count in ended(evaluation, rate, rng).items():
            low, high = interval(*end)
            covered += count * (low <= rate <= high)
        found.append(covered / DRAWS)
    return min(found)


@pytest.mark.parametrize("planned", [10, 30, pytest.param(50, marks=pytest.mark.slow), 200])
def test_intervals_of_evaluations_that_end_early_hold_the_rate_in_95_of_100(planned: int) -> None:
    assert worst_coverage(planned, plain=False) >= 0.95


@pytest.mark.parametrize("planned", [30, pytest.param(50, marks=pytest.mark.slow)])
def test_plain_intervals_would_not(planned: int) -> None:
    assert worst_coverage(planned, plain=True) < 0.948  # the standard error of DRAWS is 0.001


def test_a_clear_rate_costs_a_third_and_a_doubtful_one_as_much_as_all() -> None:
    rng = np.random.default_rng(43)

    def cost(planned: int, rate: float) -> float:
        ends = ended(Evaluation(planned, thorough=False), rate, rng)
        return sum(played * count for (_, played), count in ends.items()) / DRAWS / planned

    assert cost(200, 0.99) < 0.36
    assert cost(30, 0.995) < 0.4
    assert cost(200, 0.01) < 0.36
    assert cost(200, 0.5) == 1.0
    assert 0.99 < cost(30, 0.5) <= 1.0


@pytest.mark.parametrize(("planned", "look"), [(200, 67), (30, 10), (10, 5), (8, 5), (5, 5), (1, 1)])
def test_the_look_is_a_third_or_where_successes_alone_can_end_it(planned: int, look: int) -> None:
    evaluation = Evaluation(planned, thorough=False)
    assert evaluation.to_play(0, 0) == look
    assert evaluation.to_play(look, look) == 0
    half = look // 2
    assert evaluation.to_play(half, look) == planned - look
    assert evaluation.to_play(planned, planned) == 0


def test_thorough_plays_all_and_tells_the_plain_interval() -> None:
    evaluation = Evaluation(200, thorough=True)
    assert evaluation.to_play(67, 67) == 133
    low, high = clopper_pearson(199, 200)
    assert evaluation.figures("rate", 199, 200) == pytest.approx({"rate": 0.995, "rate_low": low, "rate_high": high})


def test_nothing_played_is_no_rate() -> None:
    evaluation = Evaluation(0, thorough=False)
    assert evaluation.to_play(0, 0) == 0
    assert set(evaluation.figures("rate", 0, 0).values()) == {None}
