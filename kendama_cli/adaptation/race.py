"""Race of motions for the largest expected success: the same perturbed simulations for all, more for the best."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr

from kendama_cli.adaptation.perturbed_simulations import BLOCK, MAX_BLOCKS
from kendama_cli.adaptation.search_record import Search
from kendama_cli.adaptation.trial import MotionVariation, Repeat, Trial

ROUNDS = ((1, 3), (2, 2), (MAX_BLOCKS, 1))
"""Blocks of simulations after each round, and the number of candidates in it: the best of the round before."""

ENOUGH = 0.98
"""Expected success from which on a candidate is evaluated no further, and nothing but tau is changed."""

MIN_SPREAD_M = 0.002
"""Joint noise alone scatters the miss by this much or more."""


def evaluations_needed(candidates: int) -> int:
    """Return the largest number of rollouts that a race of so many candidates takes."""
    return BLOCK * sum(min(candidates, entered) for _, entered in ROUNDS)


def next_evaluation(search: Search, candidates: Sequence[MotionVariation], mouth_m: float) -> Trial | None:
    """Return the next evaluation of one of the ``candidates``; None if their race has ended."""
    repeats, ahead, before = search.simulations.repeats, list(candidates), 0
    for blocks, entered in ROUNDS:
        if before:
            ahead = sorted(ahead, key=lambda one: _worth(search, one, mouth_m, before), reverse=True)
            ahead = [one for one in ahead if search.slack_in_swing(one) == search.slack_in_swing(ahead[0])]
            if min(len(ahead), entered) == 1 and expected_success(repeats(ahead[0])[:before], mouth_m) >= ENOUGH:
                return None
        ahead = ahead[:entered]
        for candidate in ahead:
            made = len(repeats(candidate))
            if made < BLOCK * blocks:
                return Trial("evaluate", candidate, made)
        before = BLOCK * blocks
    return None


def winner(search: Search, candidates: Sequence[MotionVariation], mouth_m: float) -> MotionVariation:
    """Return the best of ``candidates``, any two of them compared by as many simulations as both were evaluated in.

    The one that was evaluated in fewest wins if it is the best by so many; else those with so many are out.
    """
    remaining = {one: len(search.simulations.repeats(one)) for one in candidates}
    while True:
        fewest = min(remaining.values())
        best = max(remaining, key=lambda one: _worth(search, one, mouth_m, fewest))
        longer = {one: made for one, made in remaining.items() if made > fewest}
        if remaining[best] == fewest or not longer:
            return best
        remaining = longer


def next_final_evaluation(search: Search, winners: Sequence[MotionVariation], mouth_m: float) -> Trial | None:
    """Return the next evaluation of the best of ``winners``, until it has had as many as any of them."""
    if not winners:
        return None
    made = {one: len(search.simulations.repeats(one)) for one in winners}
    best = winner(search, winners, mouth_m)
    return Trial("evaluate", best, made[best]) if made[best] < max(made.values()) else None


def expected_success(repeats: Sequence[Repeat], mouth_m: float) -> float:
    """Return the fraction of all perturbed simulations that would be caught, by the misses in the ``repeats``.

        p = mean_i P(|m_i + h e| < mouth_m),   e standard normal,   h = 1.06 s n^(-1/5)

    with s the smaller of the misses' standard deviation and their interquartile range over 1.34 (B. W. Silverman,
    Density Estimation, 1986, eq. 3.31), at least MIN_SPREAD_M. A ball that never came down, or was lost although it
    came down within ``mouth_m``, counts as lost.
    """
    misses = np.array([one.miss_m for one in repeats if one.miss_m is not None and _decided_by_miss(one, mouth_m)])
    if len(misses) == 0:
        return 0.0
    quarter, three = np.quantile(misses, [0.25, 0.75])
    spread = min(float(np.std(misses, ddof=1)), float(three - quarter) / 1.34) if len(misses) > 1 else 0.0
    width = max(1.06 * spread * len(misses) ** -0.2, MIN_SPREAD_M)
    caught = ndtr((mouth_m - misses) / width) - ndtr((-mouth_m - misses) / width)
    return float(caught.sum()) / len(repeats)


def mean_distance_m(repeats: Sequence[Repeat]) -> float:
    """Return the mean distance of the balls from the cup's planned place as they came down; 1 m if one never did."""
    return sum(1.0 if one.miss_m is None else abs(one.miss_m) + one.correction_m for one in repeats) / len(repeats)


def _worth(search: Search, candidate: MotionVariation, mouth_m: float, count: int) -> tuple[bool, float, float]:
    """Return the rank of ``candidate`` by its first ``count`` repeats; any slack rope in a swing ranks below any taut.

    Equal successes are ranked by the smaller distance.
    """
    repeats = search.simulations.repeats(candidate)[:count]
    success = round(expected_success(repeats, mouth_m), 3)
    return not search.slack_in_swing(candidate), success, -mean_distance_m(repeats)


def _decided_by_miss(repeat: Repeat, mouth_m: float) -> bool:
    return repeat.caught or abs(repeat.miss_m or 0.0) >= mouth_m
