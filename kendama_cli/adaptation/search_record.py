"""Record of a search for a catch, from which a search that was cut off resumes, and the protocol of its methods."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Protocol

from kendama_cli.adaptation.perturbed_simulations import Attempt, MotionVariation, PerturbedSimulations, Repeat, Trial


@dataclass(frozen=True)
class Search:
    """All results so far: the attempts in order, and the perturbed simulations with the repeats in them.

    ``short_of_reach`` are the catches in whose flight a visual catch cannot go as far as the uncertainty asks for, each
    with the reason: no race takes them.
    """

    simulations: PerturbedSimulations
    attempts: tuple[Attempt, ...] = ()
    short_of_reach: tuple[tuple[MotionVariation, str], ...] = ()

    def with_attempt(self, attempt: Attempt) -> Search:
        """Return this search with one attempt more."""
        return replace(self, attempts=(*self.attempts, attempt))

    def with_repeat(self, trial: Trial, repeat: Repeat) -> Search:
        """Return this search with the repeat that ``trial`` asked for."""
        return replace(self, simulations=self.simulations.with_repeat(trial, repeat))

    def without_reach(self, variation: MotionVariation, reason: str) -> Search:
        """Return this search with the ``reason`` why ``variation`` lacks the reach that is asked for."""
        return replace(self, short_of_reach=(*self.short_of_reach, (variation, reason)))

    def reaching(self, candidates: Iterable[MotionVariation]) -> list[MotionVariation]:
        """Return those of ``candidates`` that do not lack reach."""
        short = dict(self.short_of_reach)
        return [candidate for candidate in candidates if candidate not in short]

    def evaluated_reaching(self) -> list[MotionVariation]:
        """Return the candidates that were evaluated and do not lack reach."""
        return self.reaching(variation for variation, _ in self.simulations.evaluated)

    def rollouts(self) -> int:
        """Return the number of rollouts of the search; the repeats that confirm are no part of it."""
        return len(self.attempts) + sum(len(repeats) for _, repeats in self.simulations.evaluated)

    def rollouts_to_first_catch(self) -> int | None:
        """Return the number, from 1, of the first attempt that caught."""
        return next((number for number, attempt in enumerate(self.attempts, 1) if attempt.caught), None)

    def flight(self, variation: MotionVariation) -> tuple[float, float] | None:
        """Return the fraction of the motion in which the ball flew: of ``variation``, else of the newest with any."""
        same = next((attempt.flight for attempt in self.attempts if attempt.variation == variation), None)
        return same or next((attempt.flight for attempt in reversed(self.attempts) if attempt.flight), None)

    def slack_in_swing(self, variation: MotionVariation) -> bool:
        """Return True if the rope hung slack in the swing of ``variation``."""
        return any(attempt.slack_in_swing for attempt in self.attempts if attempt.variation == variation)

    def caught(self) -> int:
        """Return the number of attempts that caught."""
        return sum(attempt.caught for attempt in self.attempts)


class CatchSearch(Protocol):
    """Method of a search: the next trial as a function of the results so far, so that a search resumes exactly."""

    def next_trial(self, search: Search) -> Trial | None:
        """Return the next trial, or None if the search has ended."""

    def rollouts(self, search: Search) -> int:
        """Return the number of rollouts of the search; the repeats that confirm are no part of it."""

    def best(self, search: Search) -> MotionVariation | None:
        """Return the motion that is confirmed, or None if there is none."""

    def expected(self, search: Search, variation: MotionVariation) -> float:
        """Return the expected success of an evaluated motion."""


MOUTH_SHARE = 0.85
"""A ball whose centre comes down within this fraction of the cup's radius stays inside.

Measured over four windows of two swings with restitutions of 0.1 to 0.4: the outermost that always stayed were at 0.6
to 1.1 of the radius, farther on the side toward which the ball drifts.
"""


@dataclass(frozen=True)
class Bounds:
    """Bounds of a search: the least tau within the arm's limits by amplitude; a miss below ``mouth_m`` is a catch."""

    lowest_tau: Callable[[float], float]
    mouth_m: float
