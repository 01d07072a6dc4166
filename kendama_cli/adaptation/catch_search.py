"""The search for a catch that lasts: which rollout comes next, as a function of those already made.

Nothing is remembered but the results, so that a search that was cut off goes on exactly where it stood.
"""

from __future__ import annotations

from dataclasses import replace
from math import hypot

from kendama_cli.adaptation.race import ENOUGH, draws_needed, next_draw, next_final_draw, winner
from kendama_cli.adaptation.search_record import Attempt, Bounds, MotionVariation, Search, Trial
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
from kendama_cli.adaptation.uncertainty import expected_success

MOST_EVALUATED = 3
"""At most so many windows are evaluated in perturbed worlds, the widest first."""

BUDGET = 40
"""Rollouts in all for the windows over tau: what the attempts leave of it decides how many windows are evaluated."""

TAU_FIRST = 3
"""So many tau are tried before the place of the catch is moved for a first catch."""

EARLY_SHIFTS = 2
"""A ball in free flight comes down where it is awaited at the first or second try."""

MOST_BASES = 3
"""At most so many rollouts are taken as starts for moving the place of the catch."""

MOST_SHIFTS = 4
"""Moving the catch by the miss is Newton's method with a slope of one: it has come down or it never will."""

LEAST_APEX_M = 0.03
"""A ball that rises less over the rim is not in flight long enough to be waited for elsewhere."""


class TauSearch:
    """The search over tau, then over the place of the catch and the motion's size."""

    def __init__(self, settings: AdaptSettings, bounds: Bounds) -> None:
        self._settings, self._bounds = settings, bounds

    def next_trial(self, search: Search) -> Trial | None:
        """The next rollout to play, or None when the search has ended."""
        return next_trial(search, self._settings, self._bounds)

    def rollouts(self, search: Search) -> int:
        """How many rollouts the search took; the fresh repeats at its end are not part of it."""
        return search.rollouts()

    def best(self, search: Search) -> MotionVariation | None:
        """What is confirmed at the end."""
        return best_candidate(search, self._bounds)

    def expected(self, search: Search, variation: MotionVariation) -> float:
        """The success that is expected of a motion that was judged."""
        return predicted_success(search, variation, self._bounds)


def next_trial(search: Search, settings: AdaptSettings, bounds: Bounds) -> Trial | None:
    """The next rollout to play, or None when the search has ended.

    First attempts over tau until one catches, then over the whole range of tau for all windows, whose middles race for
    the largest expected success in worlds drawn from the declared uncertainties. Only if none of them is predicted to
    succeed in ENOUGH of all worlds, the place of the catch is moved; only if nothing catches at all, the motion's size
    is changed. What lacks reach is no catch, and is judged only where there is nothing else: to tell what it would be
    worth. The best is repeated afresh.
    """
    for amplitude in (1.0, *settings.amplitudes):
        trial = _explore(search, settings, bounds, amplitude)
        if trial is None:
            trial = next_draw(search, _middles(search, settings, bounds, amplitude), bounds.mouth_m)
        if trial is None and _best_over_tau(search, bounds, amplitude) < ENOUGH:
            trial = _move_catch(search, settings, amplitude)
            trial = trial or next_draw(search, _moved(search, amplitude), bounds.mouth_m)
        if trial is not None:
            return trial
        caught = [one.variation for one in search.attempts if one.caught and one.variation.amplitude == amplitude]
        if search.reaching(caught):
            break
    best = best_candidate(search, bounds)
    if best is None:
        off_m = {one.variation: one.off_m for one in search.attempts}
        short = sorted(dict(search.short_of_reach), key=lambda one: (search.slack_in_swing(one), off_m[one]))
        return next_draw(search, short, bounds.mouth_m)
    trial = next_final_draw(search, _winners(search, bounds), bounds.mouth_m)
    if trial is None and len(search.confirmed) < settings.repeats:
        trial = Trial("confirm", best, len(search.confirmed))
    return trial


def windows(search: Search, settings: AdaptSettings, bounds: Bounds) -> tuple[Window, ...]:
    """The windows over tau alone at the amplitude that catches, widest first."""
    for amplitude in (1.0, *settings.amplitudes):
        where = _range(settings, bounds, amplitude)
        found = () if where is None else catch_windows(_trials(search, bounds, amplitude), where, bounds.mouth_m)
        if found:
            return found
    return ()


def best_candidate(search: Search, bounds: Bounds) -> MotionVariation | None:
    """The best of those that won a race: the largest expected success, then the least that a catch needs.

    One whose rope hangs slack in the swing is taken only where there is no other, one without reach never.
    """
    winners = _winners(search, bounds)
    return winner(search, winners, bounds.mouth_m) if winners else None


def _winners(search: Search, bounds: Bounds) -> list[MotionVariation]:
    """The winner of each race, of those that have reach."""
    races: dict[tuple[float, bool], list[MotionVariation]] = {}
    for variation in search.reaching(variation for variation, _ in search.evaluated):
        races.setdefault((variation.amplitude, variation.shifted), []).append(variation)
    return [winner(search, entered, bounds.mouth_m) for entered in races.values()]


def predicted_success(search: Search, variation: MotionVariation, bounds: Bounds) -> float:
    """The expected success of an evaluated candidate, in all worlds that it was judged in."""
    return expected_success(dict(search.evaluated)[variation], bounds.mouth_m)


def nearest_attempt(search: Search) -> Attempt:
    """The attempt that came nearest to a catch: the least miss, or the highest ball where it never came down."""
    played = [one for one in search.attempts if one.limit is None] or search.attempts
    return min(played, key=lambda one: (one.off_m, -one.apex_m))


def _explore(search: Search, settings: AdaptSettings, bounds: Bounds, amplitude: float) -> Trial | None:
    """The next attempt over tau; where the first few did not catch, the catch is moved to have one to begin with."""
    where = _range(settings, bounds, amplitude)
    if where is None or len(search.attempts) >= settings.max_rollouts:
        return None
    trials = _trials(search, bounds, amplitude)
    moved = [one for one in search.attempts if one.variation.shifted and one.variation.amplitude == amplitude]
    if len(trials) >= TAU_FIRST and len(moved) < EARLY_SHIFTS and not search.caught():
        trial = _move_catch(search, settings, amplitude)
        if trial is not None:
            return trial
    tau = next_window_tau(trials, where, bounds.mouth_m) if search.caught() else next_tau(trials, where)
    return None if tau is None else Trial("attempt", MotionVariation(tau, amplitude), len(search.attempts))


def _move_catch(search: Search, settings: AdaptSettings, amplitude: float) -> Trial | None:
    """The goal moved by what was missed, from the nearest misses of this amplitude; None where that has ended."""
    if len(search.attempts) >= settings.max_rollouts:
        return None
    here = [one for one in search.attempts if one.variation.amplitude == amplitude]
    moved = [one for one in here if one.variation.shifted]
    caught = {one.variation.tau_scale for one in moved if one.caught}
    bases = [one for one in here if not one.variation.shifted and _can_wait_elsewhere(one)]
    for base in sorted(bases, key=lambda one: (one.variation.tau_scale not in caught, one.off_m))[:MOST_BASES]:
        made = [one for one in moved if one.variation.tau_scale == base.variation.tau_scale]
        last = made[-1] if made else base
        if base.variation.tau_scale in caught and (last.off_m < CENTRED_M or len(made) >= MOST_SHIFTS):
            return None
        if last.signed_miss_m is None or len(made) >= MOST_SHIFTS:
            continue
        x, y = last.variation.shift_m
        shift = (x + last.signed_miss_m, y + (last.side_miss_m or 0.0))
        if hypot(*shift) <= settings.max_shift_m:
            variation = replace(last.variation, shift_m=shift, flight=base.flight or (0.0, 1.0))
            return Trial("attempt", variation, len(search.attempts))
    return None


def _can_wait_elsewhere(attempt: Attempt) -> bool:
    """Whether the ball flies high enough, and comes down before the motion ends: later the goal is long reached."""
    return attempt.flight is not None and attempt.flight[1] <= 1.0 and attempt.apex_m > LEAST_APEX_M


def _middles(search: Search, settings: AdaptSettings, bounds: Bounds, amplitude: float) -> list[MotionVariation]:
    """The middle of every window of this amplitude that there is still budget to evaluate, the widest first.

    Those whose rope hangs slack in the swing come last; those that lack reach are left out.
    """
    where = _range(settings, bounds, amplitude)
    if where is None:
        return []
    trials = _trials(search, bounds, amplitude)
    left = BUDGET - len(trials)
    most = next((many for many in range(MOST_EVALUATED, 1, -1) if draws_needed(many) <= left), 1)
    found = catch_windows(trials, where, bounds.mouth_m)
    middles = [MotionVariation(window.best.tau_scale, amplitude) for window in found]
    return sorted(search.reaching(middles), key=search.slack_in_swing)[:most]


def _moved(search: Search, amplitude: float) -> list[MotionVariation]:
    """The best catch at a moved place."""
    moved = [one for one in search.attempts if one.variation.shifted and one.variation.amplitude == amplitude]
    caught = sorted((one for one in moved if one.caught), key=lambda one: one.off_m)
    return search.reaching(one.variation for one in caught)[:1]


def _best_over_tau(search: Search, bounds: Bounds, amplitude: float) -> float:
    """The largest predicted success of what was evaluated over tau alone."""
    judged = search.reaching(variation for variation, _ in search.evaluated)
    plain = [one for one in judged if not one.shifted and one.amplitude == amplitude]
    return predicted_success(search, winner(search, plain, bounds.mouth_m), bounds) if plain else 0.0


def _range(settings: AdaptSettings, bounds: Bounds, amplitude: float) -> TauRange | None:
    low, high = max(settings.tau_range[0], bounds.lowest_tau.get(amplitude, float("inf"))), settings.tau_range[1]
    if low > high:
        return None
    return TauRange(low, high, max(low, settings.tau_start), settings.tau_step, settings.tau_resolution)


def _trials(search: Search, bounds: Bounds, amplitude: float) -> list[TauTrial]:
    """What tau did at this amplitude; a ball that comes down beside the swing plane is none that tau could catch."""
    trials = []
    for one in search.attempts:
        if one.variation.amplitude == amplitude and not one.variation.shifted:
            beside = abs(one.side_miss_m or 0.0) > bounds.mouth_m
            trials.append(TauTrial(one.variation.tau_scale, None if beside else one.signed_miss_m, one.caught))
    return trials
