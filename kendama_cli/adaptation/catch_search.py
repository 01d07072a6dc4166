"""Search for a robust catch over tau, then over the goal and the motion's size.

Its candidates race for the maximum expected success: the same perturbed simulations for all, more for the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import hypot

import numpy as np
from scipy.special import ndtr

from kendama_cli.adaptation.search_record import (
    BLOCK,
    MAX_BLOCKS,
    Attempt,
    Bounds,
    MotionVariation,
    Repeat,
    Search,
    Trial,
)
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.adaptation.time_scaling import (
    CENTRED_M,
    TauRange,
    TauTrial,
    Window,
    catch_windows,
    next_tau,
    next_window_tau,
)

ROUNDS = ((1, 3), (2, 2), (MAX_BLOCKS, 1))
"""Blocks of simulations after each round, and the number of candidates in it: the best of the round before."""

ENOUGH = 0.98
"""Expected success from which on a candidate is evaluated no further, and nothing but tau is changed."""

MIN_SPREAD_M = 0.002
"""Joint noise alone scatters the miss by this much or more."""


def evaluations_needed(candidates: int) -> int:
    """Return the maximum number of rollouts that a race of so many candidates takes."""
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
    """Return the best of ``candidates``, any two of them compared by as many simulations as both were evaluated in."""
    remaining = {one: len(search.simulations.repeats(one)) for one in candidates}
    while True:
        fewest = min(remaining.values())
        best = max(remaining, key=lambda one: _worth(search, one, mouth_m, fewest))
        longer = {one: made for one, made in remaining.items() if made > fewest}
        # The one that was evaluated in fewest wins if it is the best by so many; else those with so many are out.
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
    """Return the mean distance of the balls from the cup's planned position as they came down; 1 m if one never did."""
    return sum(1.0 if one.miss_m is None else abs(one.miss_m) + one.correction_m for one in repeats) / len(repeats)


def _worth(search: Search, candidate: MotionVariation, mouth_m: float, count: int) -> tuple[bool, float, float]:
    """Return the rank by the first ``count`` repeats: a taut rope in the swing, then the success, then the distance."""
    repeats = search.simulations.repeats(candidate)[:count]
    success = round(expected_success(repeats, mouth_m), 3)
    return not search.slack_in_swing(candidate), success, -mean_distance_m(repeats)


def _decided_by_miss(repeat: Repeat, mouth_m: float) -> bool:
    return repeat.caught or abs(repeat.miss_m or 0.0) >= mouth_m


MAX_WINDOWS = 3
"""At most so many windows are evaluated in perturbed simulations, the widest first."""

BUDGET = 40
"""Rollouts in all for the windows over tau: what the attempts leave of it decides how many windows are evaluated."""

TAU_FIRST = 3
"""So many tau are tried before the position of the catch is moved for a first catch."""

EARLY_SHIFTS = 2
"""A ball in free flight comes down where it is awaited at the first or second try."""

MAX_BASES = 3
"""At most so many rollouts are taken as starts for moving the position of the catch."""

MAX_SHIFTS = 4
"""Moving the catch by the miss is Newton's method with a slope of one: it has come down or it never will."""

MIN_APEX_M = 0.03
"""A ball that rises less over the rim is not in flight long enough to be waited for elsewhere."""


class TauSearch:
    """Search over tau, then over the position of the catch and the motion's size, within ``bounds``."""

    def __init__(self, settings: AdaptSettings, bounds: Bounds) -> None:
        self._settings, self._bounds, self._mouth_m = settings, bounds, bounds.mouth_m

    def next_trial(self, search: Search) -> Trial | None:
        """Return the next trial, or None if the search has ended.

        First attempts over tau until one catches, then over the whole range of tau for all windows, whose centres race
        for the maximum expected success in perturbed simulations. Only if none of them is expected to succeed in ENOUGH
        of all, the catch is moved; only if nothing catches at all, the motion's size is changed. A catch without reach
        is evaluated only if there is no other: to report what it would be worth. The best is confirmed.
        """
        for amplitude in (1.0, *self._settings.amplitudes):
            trial = self._explore(search, amplitude)
            if trial is None:
                trial = next_evaluation(search, self._centers(search, amplitude), self._mouth_m)
            if trial is None and self._best_over_tau(search, amplitude) < ENOUGH:
                trial = self._move_catch(search, amplitude)
                trial = trial or next_evaluation(search, _best_moved(search, amplitude), self._mouth_m)
            if trial is not None:
                return trial
            if search.reaching(one.variation for one in _at(search, amplitude) if one.caught):
                break
        best = self.best(search)
        if best is None:
            distance_m = {one.variation: one.distance_m for one in search.attempts}
            short = sorted(dict(search.short_of_reach), key=lambda one: (search.slack_in_swing(one), distance_m[one]))
            return next_evaluation(search, short, self._mouth_m)
        trial = next_final_evaluation(search, self._winners(search), self._mouth_m)
        return trial or search.next_confirmation(best, self._settings.evaluation)

    def rollouts(self, search: Search) -> int:
        """Return the number of rollouts of the search; the repeats that confirm are no part of it."""
        return search.rollouts()

    def best(self, search: Search) -> MotionVariation | None:
        """Return the best winner of a race: the maximum expected success, then the least that a catch needs.

        One whose rope hangs slack in the swing is taken only if there is no other, one without reach never.
        """
        winners = self._winners(search)
        return winner(search, winners, self._mouth_m) if winners else None

    def expected(self, search: Search, variation: MotionVariation) -> float:
        """Return the expected success of an evaluated motion."""
        return expected_success(search.simulations.repeats(variation), self._mouth_m)

    def windows(self, search: Search) -> tuple[Window, ...]:
        """Return the windows over tau alone at the amplitude that catches, widest first."""
        found = (self._windows(search, amplitude) for amplitude in (1.0, *self._settings.amplitudes))
        return next((windows for windows in found if windows), ())

    def _winners(self, search: Search) -> list[MotionVariation]:
        """Return the winner of each race, of those that have reach."""
        races: dict[tuple[float, bool], list[MotionVariation]] = {}
        for variation in search.evaluated_reaching():
            races.setdefault((variation.amplitude, variation.shifted), []).append(variation)
        return [winner(search, entered, self._mouth_m) for entered in races.values()]

    def _explore(self, search: Search, amplitude: float) -> Trial | None:
        """Return the next attempt over tau; if the first few did not catch, one at a moved catch to begin with."""
        where = self._range(amplitude)
        if where is None or len(search.attempts) >= self._settings.max_rollouts:
            return None
        trials = self._trials(search, amplitude)
        moved = [one for one in _at(search, amplitude) if one.variation.shifted]
        if len(trials) >= TAU_FIRST and len(moved) < EARLY_SHIFTS and not search.caught():
            trial = self._move_catch(search, amplitude)
            if trial is not None:
                return trial
        tau = next_window_tau(trials, where, self._mouth_m) if search.caught() else next_tau(trials, where)
        return None if tau is None else Trial("attempt", MotionVariation(tau, amplitude), len(search.attempts))

    def _move_catch(self, search: Search, amplitude: float) -> Trial | None:
        """Return an attempt with the goal moved by what was missed, from the nearest misses; None at the end."""
        if len(search.attempts) >= self._settings.max_rollouts:
            return None
        moved = [one for one in _at(search, amplitude) if one.variation.shifted]
        caught = {one.variation.tau_scale for one in moved if one.caught}
        bases = [one for one in _at(search, amplitude) if not one.variation.shifted and _can_wait_elsewhere(one)]
        for base in sorted(bases, key=lambda one: (one.variation.tau_scale not in caught, one.distance_m))[:MAX_BASES]:
            made = [one for one in moved if one.variation.tau_scale == base.variation.tau_scale]
            last = made[-1] if made else base
            if base.variation.tau_scale in caught and (last.distance_m < CENTRED_M or len(made) >= MAX_SHIFTS):
                return None
            if last.signed_miss_m is None or len(made) >= MAX_SHIFTS:
                continue
            x, y = last.variation.shift_m
            shift = (x + last.signed_miss_m, y + (last.side_miss_m or 0.0))
            if hypot(*shift) <= self._settings.max_shift_m:
                variation = replace(last.variation, shift_m=shift, flight=base.flight or (0.0, 1.0))
                return Trial("attempt", variation, len(search.attempts))
        return None

    def _centers(self, search: Search, amplitude: float) -> list[MotionVariation]:
        """Return the centre of every window that there is still budget to evaluate, the widest first.

        Those whose rope hangs slack in the swing come last; those that lack reach are left out.
        """
        remaining = BUDGET - len(self._trials(search, amplitude))
        count = next((many for many in range(MAX_WINDOWS, 1, -1) if evaluations_needed(many) <= remaining), 1)
        centers = [MotionVariation(one.best.tau_scale, amplitude) for one in self._windows(search, amplitude)]
        return sorted(search.reaching(centers), key=search.slack_in_swing)[:count]

    def _best_over_tau(self, search: Search, amplitude: float) -> float:
        """Return the maximum expected success of what was evaluated over tau alone."""
        plain = [one for one in search.evaluated_reaching() if not one.shifted and one.amplitude == amplitude]
        return self.expected(search, winner(search, plain, self._mouth_m)) if plain else 0.0

    def _windows(self, search: Search, amplitude: float) -> tuple[Window, ...]:
        where = self._range(amplitude)
        return () if where is None else catch_windows(self._trials(search, amplitude), where, self._mouth_m)

    def _range(self, amplitude: float) -> TauRange | None:
        settings = self._settings
        low, high = max(settings.tau_range[0], self._bounds.lowest_tau(amplitude)), settings.tau_range[1]
        if low > high:
            return None
        return TauRange(low, high, max(low, settings.tau_start), settings.tau_step, settings.tau_resolution)

    def _trials(self, search: Search, amplitude: float) -> list[TauTrial]:
        """Return what tau did; a ball that comes down off the swing plane is none that tau could catch."""
        trials = []
        for one in _at(search, amplitude):
            if not one.variation.shifted:
                beside = abs(one.side_miss_m or 0.0) > self._mouth_m
                trials.append(TauTrial(one.variation.tau_scale, None if beside else one.signed_miss_m, one.caught))
        return trials


def nearest_attempt(search: Search) -> Attempt:
    """Return the attempt nearest to a catch: the least miss, or the highest ball if it never came down."""
    played = [one for one in search.attempts if one.limit is None] or search.attempts
    return min(played, key=lambda one: (one.distance_m, -one.apex_m))


def _at(search: Search, amplitude: float) -> list[Attempt]:
    return [one for one in search.attempts if one.variation.amplitude == amplitude]


def _can_wait_elsewhere(attempt: Attempt) -> bool:
    """Return True if the ball flies high enough, and comes down before the motion ends and the goal is long reached."""
    return attempt.flight is not None and attempt.flight[1] <= 1.0 and attempt.apex_m > MIN_APEX_M


def _best_moved(search: Search, amplitude: float) -> list[MotionVariation]:
    """Return the best catch with a moved goal, if there is one."""
    caught = [one for one in _at(search, amplitude) if one.variation.shifted and one.caught]
    return search.reaching(one.variation for one in sorted(caught, key=lambda one: one.distance_m))[:1]
