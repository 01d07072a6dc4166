"""Rollouts of a policy that learns no more, side by side on every core, and the random baseline of a task."""

from __future__ import annotations

import copy
import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.random import Generator

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.errors import StageError
from kendama_cli.learning.interface import Actor, Learner
from kendama_cli.learning.learners import begin_learner, make_policy, resume_learner
from kendama_cli.learning.settings import LearnSettings, RandomSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import RailEngine
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.rollout import RolloutNoise, SimulatedRollout
from kendama_cli.system.processes import PROCESSES, process_pool, processes

Frozen = PolicyArtifact | Mapping[str, Any]
"""What acts: a policy, or the state of a learner whose ``count`` says frozen."""
Reading = tuple[SwingState, float]
"""What the actor was asked, and when in the rollout [s]."""


@dataclass(frozen=True)
class WatchedRollout:
    """A rollout, and all that its actor was asked."""

    rollout: SimulatedRollout
    readings: tuple[Reading, ...]


class FrozenRollouts:
    """Rollouts in one simulation, computed ahead, in their order; in compiled code each when it is due.

    Noise is sampled from the stream as if each rollout drew its own when it was due. So neither results nor
    checkpoints depend on how many processes there are, or on how far ahead they were.
    """

    def __init__(self, environment: SwingUpEnvironment) -> None:
        """Start processes that make environments of their own, of the same settings."""
        self._environment = environment
        self._coming: Iterator[WatchedRollout] = iter(())
        self._ahead = 0
        self._pool: ProcessPoolExecutor | None = None
        self._open = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._open.close()

    def validate(self, learner: Learner, exploration: Generator, rng: Generator, *, at_most: int) -> SimulatedRollout:
        """Play a rollout of a frozen ``learner``, which is left as if it had acted in it and has still to end it.

        ``exploration`` is what the learner begins the rollout with, noise comes from ``rng``. ``at_most`` so many
        follow one another, this one included; after a failure none does, for it learns on.
        """
        if self._environment.compiled:
            learner.begin_rollout(exploration)
            return self._environment.roll_out(learner, self._environment.noise(rng, validation=True))
        watched = self._next(learner.state, rng, at_most, validation=True)
        learner.begin_rollout(exploration)
        for reading, t_s in watched.readings:
            learner.act(reading, t_s)
        if not watched.rollout.success:
            self._coming, self._ahead = iter(()), 0
        return watched.rollout

    def evaluate(self, policy: PolicyArtifact, rng: Generator, *, at_most: int) -> SimulatedRollout:
        """Play a rollout by ``policy``, on noise from ``rng``; ``at_most`` so many follow one another."""
        if self._environment.compiled:
            return self._environment.roll_out(_actor(policy, self._environment.settings), self._environment.noise(rng))
        return self._next(lambda: policy, rng, at_most, validation=False).rollout

    def _next(self, frozen: Callable[[], Frozen], rng: Generator, at_most: int, *, validation: bool) -> WatchedRollout:
        if not self._ahead:
            ahead = copy.deepcopy(rng)
            noises = [self._environment.noise(ahead, validation=validation) for _ in range(at_most)]
            self._coming, self._ahead = self._begun(frozen(), noises), at_most
        self._environment.noise(rng, validation=validation)
        self._ahead -= 1
        try:
            return next(self._coming)
        except BrokenProcessPool:
            raise StageError(
                "a process that computed rollouts was killed (out of memory?); run again: it resumes from here, and "
                f"{PROCESSES}=1 takes no processes beside its own"
            ) from None

    def _begun(self, frozen: Frozen, noises: list[RolloutNoise]) -> Iterator[WatchedRollout]:
        if processes() == 1:
            return (_watched(self._environment, frozen, noise) for noise in noises)
        if self._pool is None:
            environment = self._environment
            self._pool = self._open.enter_context(process_pool(_begin, environment.settings, environment.game))
        return self._pool.map(_roll_out, itertools.repeat(frozen), noises)


def _watched(environment: SwingUpEnvironment, frozen: Frozen, noise: RolloutNoise) -> WatchedRollout:
    watched = _Watched(_actor(frozen, environment.settings))
    return WatchedRollout(environment.roll_out(watched, noise), tuple(watched.readings))


def _actor(frozen: Frozen, settings: LearnSettings) -> Actor:
    """Return the actor that ``frozen`` describes, in a new rollout."""
    if isinstance(frozen, PolicyArtifact):
        policy = make_policy(frozen, settings)
        policy.begin_rollout()
        return policy
    learner = resume_learner(settings, frozen)
    learner.begin_rollout(np.random.default_rng(0))  # frozen, it does not explore
    return learner


class _Watched:
    """An actor, asked at every reading that it wants."""

    decides_on_bins = False

    def __init__(self, actor: Actor) -> None:
        self._actor = actor
        self.readings: list[Reading] = []

    @property
    def next_look_s(self) -> float:
        return self._actor.next_look_s

    def act(self, state: SwingState, t_s: float) -> float:
        self.readings.append((state, t_s))
        return self._actor.act(state, t_s)


_own: SwingUpEnvironment | None = None


def _begin(settings: LearnSettings, game: GameSettings) -> None:
    global _own  # noqa: PLW0603 - one per process, made when it begins
    _own = SwingUpEnvironment(settings, game)


def _roll_out(frozen: Frozen, noise: RolloutNoise) -> WatchedRollout:
    assert _own is not None
    return _watched(_own, frozen, noise)


ROLLOUTS = 400
_SEED = 324


@functools.lru_cache(maxsize=16)
def random_success_rate(settings: LearnSettings, game: GameSettings) -> float:
    """Fraction of ROLLOUTS rollouts on the rail that succeed, each driven by a newly sampled harmonic."""
    drawing = dataclasses.replace(settings, learner=RandomSettings("random"), engine=RailEngine("rail"))
    environment, learner = SwingUpEnvironment(drawing, game), begin_learner(drawing)
    noise_rng, harmonic_rng = np.random.default_rng([_SEED, 1]), np.random.default_rng([_SEED, 2])
    succeeded = 0
    for _ in range(ROLLOUTS):
        learner.begin_rollout(harmonic_rng)
        rollout = environment.roll_out(learner, environment.noise(noise_rng))
        learner.end_rollout("timeout", rollout.final)  # so that no streak ever freezes what is drawn
        succeeded += rollout.success
    return succeeded / ROLLOUTS
