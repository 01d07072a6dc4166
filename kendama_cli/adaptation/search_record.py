"""Record of a search for a catch, from which it resumes: trials, perturbed simulations, results; and its methods."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from math import hypot, inf
from typing import Protocol

import numpy as np

from kendama_cli.adaptation.perturbation import (
    BALL_START,
    FACTORS,
    LABORATORY,
    LABORATORY_FACTORS,
    LaboratoryFactors,
    Perturbation,
    sampled,
)
from kendama_cli.adaptation.settings import UncertaintySettings
from kendama_cli.artifacts.proportion import Evaluation
from kendama_cli.physics.rim_crossing import SLACK_S
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.arm_errors import NO_ERRORS


@dataclass(frozen=True)
class MotionVariation:
    """Variation of a motion: ``shift_m`` moves the goal along x and y within the fraction ``flight`` of the motion.

    ``bumps_m`` are the heights of the bumps by which the path is bent (catch_family); empty without any.
    """

    tau_scale: float
    amplitude: float = 1.0
    shift_m: tuple[float, float] = (0.0, 0.0)
    flight: tuple[float, float] = (0.0, 1.0)
    bumps_m: tuple[float, ...] = ()

    @property
    def shifted(self) -> bool:
        """True if the goal is moved."""
        return self.shift_m != (0.0, 0.0)


@dataclass(frozen=True)
class Trial:
    """Trial that a search asks for: a ``variation`` to simulate.

    ``kind`` names the simulation. ``attempt``: undisturbed, as planned. ``evaluate``: perturbed simulation ``index`` of
    those that all candidates share. ``confirm``: repeat ``index`` of the chosen motion, freshly sampled. A policy
    search has two of its own: ``explore``, rollout ``index`` in the one perturbed simulation of generation ``group``,
    and ``validate``, repeat ``index`` in a fresh one after ``group`` rollouts.
    """

    kind: str
    variation: MotionVariation
    index: int
    group: int = 0


@dataclass(frozen=True)
class Attempt:
    """Result of an ``attempt`` or ``explore``; misses, ``apex_m`` and ``swing_slack_s`` as in RolloutResult.

    ``flight`` is the fraction of the motion in which the ball flew, ``forward`` 1 or -1 as it flew along x or against
    it. ``limit`` names the limit of the arm that forbade
    the motion, so that nothing was simulated. ``correction_m`` is the distance of the cup from its plan at the catch.
    """

    variation: MotionVariation
    caught: bool
    signed_miss_m: float | None
    side_miss_m: float | None
    apex_m: float
    flight: tuple[float, float] | None
    limit: str | None = None
    swing_slack_s: float = 0.0
    correction_m: float = 0.0
    forward: float = 1.0

    @property
    def slack_in_swing(self) -> bool:
        """True if the rope hung slack in the swing: then its mass, which no model here has, decides the miss."""
        return self.swing_slack_s >= SLACK_S

    @property
    def distance_m(self) -> float:
        """Distance from the cup's centre at which the ball came down; infinite if it did not."""
        return inf if self.signed_miss_m is None else hypot(self.signed_miss_m, self.side_miss_m or 0.0)


@dataclass(frozen=True)
class Repeat:
    """Result of a motion in one perturbed simulation; ``miss_m`` is None if the ball never came down.

    ``correction_m`` is the distance of the cup from its plan then, ``swing_slack_s`` as in RolloutResult.
    """

    caught: bool
    miss_m: float | None
    correction_m: float = 0.0
    swing_slack_s: float = 0.0


BLOCK = 4
"""Simulations that evaluate come in Latin hypercubes of this size: one in each quarter of every factor's range."""

MAX_BLOCKS = 3
"""Blocks in which the best candidates are evaluated."""


@dataclass(frozen=True)
class PerturbedSimulations:
    """Perturbed simulations of one search, by their seeds, and the repeats that were run in them.

    Attributes: ``uncertainty``, to sample from; ``rope_m``, the rope's length; ``seeds``, first that of all samples of
    the search, then one for each evaluation and one for each repeat that confirms, so that their number changes nothing
    before them; ``held``, all simulations are perturbed alike but for the ball's start and the noise; ``evaluated``,
    the repeats of each candidate in order; ``confirmed``, those of the chosen motion.
    """

    uncertainty: UncertaintySettings
    rope_m: float
    seeds: tuple[int, ...]
    held: bool = False
    evaluated: tuple[tuple[MotionVariation, tuple[Repeat, ...]], ...] = ()
    confirmed: tuple[Repeat, ...] = ()

    @staticmethod
    def seeded(
        uncertainty: UncertaintySettings, rope_m: float, repeats: int, rng: np.random.Generator, *, held: bool = False
    ) -> PerturbedSimulations:
        """Return the simulations of a new search that ends with ``repeats``, their seeds sampled from ``rng``."""
        seeds = rng.integers(2**62, size=1 + BLOCK * MAX_BLOCKS + repeats)
        return PerturbedSimulations(uncertainty, rope_m, tuple(seeds.tolist()), held)

    def perturbation(self, trial: Trial) -> Perturbation:
        """Return the perturbation in which ``trial`` is run."""
        if trial.kind in {"explore", "validate"}:
            stream = (0, trial.group) if trial.kind == "explore" else (1, trial.group, trial.index)
            rng = np.random.default_rng([self.seeds[0], *stream])
            factors = rng.random(FACTORS)
            return self._sampled(factors, int(rng.integers(2**62)), rng)
        confirms = trial.kind == "confirm"
        seed = self.seeds[1 + trial.index + BLOCK * MAX_BLOCKS * confirms]
        rng = np.random.default_rng(seed)
        return self._sampled(rng.random(FACTORS) if confirms else self._in_block(trial.index), seed, rng)

    def undisturbed(self) -> Perturbation:
        """Return the simulation as modelled, in which the sensor model alone is noisy."""
        return Perturbation(NO_ERRORS, None, self.seeds[1])

    def repeats(self, variation: MotionVariation) -> tuple[Repeat, ...]:
        """Return the repeats that evaluated ``variation`` until now."""
        return dict(self.evaluated).get(variation, ())

    def with_repeat(self, trial: Trial, repeat: Repeat) -> PerturbedSimulations:
        """Return these simulations with the ``repeat`` that ``trial`` asked for."""
        if trial.kind == "confirm":
            return replace(self, confirmed=(*self.confirmed, repeat))
        evaluated = {**dict(self.evaluated), trial.variation: (*self.repeats(trial.variation), repeat)}
        return replace(self, evaluated=tuple(evaluated.items()))

    def _in_block(self, index: int) -> Array:
        """Return the factors (FACTORS,) in [0, 1) of the evaluation ``index``."""
        block, inside = divmod(index, BLOCK)
        rng = np.random.default_rng([self.seeds[0], block])
        quarter = rng.permuted(np.tile(np.arange(BLOCK), (FACTORS, 1)), axis=1)[:, inside]
        return np.asarray((quarter + rng.random((BLOCK, FACTORS))[inside]) / BLOCK)

    def _sampled(self, factors: Array, sensor_seed: int, rng: np.random.Generator) -> Perturbation:
        """Return the perturbation with every quantity at its fraction ``factors`` (FACTORS,) of the declared range."""
        fresh = held = np.random.default_rng([sensor_seed, LABORATORY]).random(LABORATORY_FACTORS)
        if self.held:
            start = factors[BALL_START]
            factors = np.random.default_rng([self.seeds[0], 2]).random(FACTORS)
            factors[BALL_START] = start
            held = np.random.default_rng([self.seeds[0], 3]).random(LABORATORY_FACTORS)
        laboratory = LaboratoryFactors.of(held, fresh)
        return sampled(self.uncertainty, self.rope_m, factors, laboratory, sensor_seed=sensor_seed, rng=rng)


@dataclass(frozen=True)
class Search:
    """All results so far: the attempts in order, and the perturbed simulations with the repeats in them.

    ``short_of_reach`` are the catches in whose flight a visual catch cannot go as far as the uncertainty asks for, each
    with the reason: no race takes them.
    """

    simulations: PerturbedSimulations
    attempts: tuple[Attempt, ...] = ()
    short_of_reach: tuple[tuple[MotionVariation, str], ...] = ()

    def next_confirmation(self, best: MotionVariation, evaluation: Evaluation) -> Trial | None:
        """Return the next repeat that confirms ``best``; None where its ``evaluation`` has ended."""
        confirmed = self.simulations.confirmed
        remaining = evaluation.to_play(sum(one.caught for one in confirmed), len(confirmed))
        return Trial("confirm", best, len(confirmed)) if remaining else None

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
