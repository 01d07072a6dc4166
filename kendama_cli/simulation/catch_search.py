"""The search for a catch that lasts: which rollout comes next, as a function of those already made.

Nothing is remembered but the results, so that a search that was cut off goes on exactly where it stood.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

from kendama_cli.motion.time_scaling import TauRange, Trial, bracket_tau, catch_windows, next_grid_tau, next_tau
from kendama_cli.settings.adapt import AdaptSettings

MOST_JUDGED = 4
"""At most so many windows are judged by repeats, the widest first."""

CENTRED_M = 0.003
"""A window's candidate whose nominal miss is below this is centred well enough."""

MOST_CENTRINGS = 2


@dataclass(frozen=True)
class Attempt:
    """One nominal rollout of the search; ``signed_miss_m`` and ``apex_m`` as in RolloutResult."""

    amplitude: float
    tau_scale: float
    caught: bool
    signed_miss_m: float | None
    apex_m: float


@dataclass(frozen=True)
class Repeat:
    """One perturbed rollout; ``miss_m`` is None where the ball never came down through the rim's plane."""

    caught: bool
    miss_m: float | None


@dataclass(frozen=True)
class Job:
    """What to play next: a nominal ``attempt``, or the repeat number ``index`` to ``judge`` or to ``confirm``."""

    kind: str
    amplitude: float
    tau_scale: float
    index: int


@dataclass(frozen=True)
class Search:
    """All results so far: attempts in order, repeats of each judged candidate, and those of the chosen motion."""

    attempts: tuple[Attempt, ...] = ()
    judged: tuple[tuple[float, float, tuple[Repeat, ...]], ...] = ()
    confirmed: tuple[Repeat, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "attempts": [asdict(one) for one in self.attempts],
            "judged": [[a, tau, [asdict(repeat) for repeat in repeats]] for a, tau, repeats in self.judged],
            "confirmed": [asdict(one) for one in self.confirmed],
        }

    @staticmethod
    def from_json(state: Mapping[str, Any]) -> Search:
        """The search that ``to_json`` wrote."""
        return Search(
            tuple(Attempt(**one) for one in state["attempts"]),
            tuple((a, tau, tuple(Repeat(**one) for one in repeats)) for a, tau, repeats in state["judged"]),
            tuple(Repeat(**one) for one in state["confirmed"]),
        )

    def with_attempt(self, attempt: Attempt) -> Search:
        """This search and one attempt more."""
        return Search((*self.attempts, attempt), self.judged, self.confirmed)

    def with_repeat(self, job: Job, repeat: Repeat) -> Search:
        """This search and the repeat that ``job`` asked for."""
        if job.kind == "confirm":
            return Search(self.attempts, self.judged, (*self.confirmed, repeat))
        judged = list(self.judged)
        if judged and judged[-1][:2] == (job.amplitude, job.tau_scale):
            judged[-1] = (job.amplitude, job.tau_scale, (*judged[-1][2], repeat))
        else:
            judged.append((job.amplitude, job.tau_scale, (repeat,)))
        return Search(self.attempts, tuple(judged), self.confirmed)

    def rollouts(self) -> int:
        """All rollouts that the search took; the fresh repeats at its end are not part of it."""
        return len(self.attempts) + sum(len(repeats) for _, _, repeats in self.judged)

    def rollouts_to_first_catch(self) -> int | None:
        """The number of the first attempt that caught, from 1."""
        return next((i + 1 for i, one in enumerate(self.attempts) if one.caught), None)


def next_job(search: Search, settings: AdaptSettings, lowest_tau: Mapping[float, float]) -> Job | None:
    """The next rollout to play, or None when the search has ended.

    First attempts at amplitude 1 until one catches, and over the whole range of tau for all windows; only if none
    catches, the other amplitudes. Then every window's centre is judged by the same perturbed repeats, and the best is
    repeated afresh. ``lowest_tau`` is the least tau within the arm's limits by amplitude.
    """
    attempt = _next_attempt(search, settings, lowest_tau)
    if attempt is not None:
        return attempt
    for amplitude, tau in _candidates(search):
        made = next((repeats for a, t, repeats in search.judged if (a, t) == (amplitude, tau)), ())
        if len(made) < settings.judge_repeats:
            return Job("judge", amplitude, tau, len(made))
    best = best_candidate(search)
    if best is not None and len(search.confirmed) < settings.repeats:
        return Job("confirm", best[0], best[1], len(search.confirmed))
    return None


def best_candidate(search: Search) -> tuple[float, float] | None:
    """Amplitude and tau_scale that caught most of the judging repeats, the nearest to the middle among equals."""

    def worth(entry: tuple[float, float, tuple[Repeat, ...]]) -> tuple[int, float]:
        misses = [1.0 if repeat.miss_m is None else abs(repeat.miss_m) for repeat in entry[2]]
        return sum(repeat.caught for repeat in entry[2]), -sum(misses) / len(misses)

    if not search.judged:
        return None
    amplitude, tau, _ = max(search.judged, key=worth)
    return amplitude, tau


def nearest_attempt(search: Search) -> Attempt:
    """The attempt that came nearest to a catch: the least miss, or the highest ball where it never came down."""
    return max(
        search.attempts,
        key=lambda one: (-(abs(one.signed_miss_m) if one.signed_miss_m is not None else 9.0), one.apex_m),
    )


def _trials(search: Search, amplitude: float) -> list[Trial]:
    return [
        Trial(one.tau_scale, one.signed_miss_m, one.caught) for one in search.attempts if one.amplitude == amplitude
    ]


def _next_attempt(search: Search, settings: AdaptSettings, lowest_tau: Mapping[float, float]) -> Job | None:
    if len(search.attempts) >= settings.max_rollouts:
        return None
    for amplitude in (1.0, *settings.amplitudes):
        low = max(settings.tau_range[0], lowest_tau.get(amplitude, float("inf")))
        if low > settings.tau_range[1]:
            continue
        start = max(low, settings.tau_start)
        where = TauRange(low, settings.tau_range[1], start, settings.tau_step, settings.tau_resolution)
        trials = _trials(search, amplitude)
        if not any(trial.caught for trial in trials):
            tau = next_tau(trials, where)
        else:
            tau = _centring(trials, where) or bracket_tau(trials, where) or next_grid_tau(trials, where)
            if tau is None:
                return None
        if tau is not None:
            return Job("attempt", amplitude, tau, len(search.attempts))
    return None


def _centring(trials: Sequence[Trial], where: TauRange) -> float | None:
    """A tau that brings the nominal miss of a window's best trial nearer to zero."""
    ranked = sorted(trials, key=lambda trial: trial.tau_scale)
    for window in catch_windows(trials):
        if len(window) > MOST_CENTRINGS or min(_miss(trial) for trial in window) < CENTRED_M:
            continue
        first, last = ranked.index(window[0]), ranked.index(window[-1])
        around = ranked[max(first - 1, 0) : last + 2]
        for left, right in pairwise(around):
            a, b, gap = left.signed_miss_m, right.signed_miss_m, right.tau_scale - left.tau_scale
            if a is not None and b is not None and a * b < 0 and where.resolution < gap < 2.5 * where.step:
                return left.tau_scale + gap * min(max(a / (a - b), 0.1), 0.9)
    return None


def _miss(trial: Trial) -> float:
    return 1.0 if trial.signed_miss_m is None else abs(trial.signed_miss_m)


def _candidates(search: Search) -> list[tuple[float, float]]:
    amplitude = next((one.amplitude for one in search.attempts if one.caught), None)
    if amplitude is None:
        return []
    windows = catch_windows(_trials(search, amplitude))[:MOST_JUDGED]
    return [(amplitude, min(window, key=_miss).tau_scale) for window in windows]
