"""The baselines of learning the swing-up: random harmonics, replayed from the first that succeeded, or never.

They have no table and learn nothing about states: what a learner needs fewer rollouts for than ``random_replay``, it
owes to more than chance. Harmonics are sampled as in an exploring rollout, until one succeeds; from then on that one
is replayed, and counts as the greedy policy. After a replay that failed the next rollout samples anew with the
probability ``after_failure``, and a success replaces what is replayed. ``random`` samples anew for every rollout, and
counts each as greedy; its policy is the last one drawn. Actions change at the same times as those of a table.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.random import Generator

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import BinActor, HeldAction, task_meaning
from kendama_cli.learning.exploration import DrawnHarmonic, Harmonic, draw_harmonic, drives_place, explores
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.rewarded_actor import RewardedActor, RolloutLearner
from kendama_cli.learning.settings import LearnSettings, RandomReplaySettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount
from kendama_cli.schema.arrays import Array

STILL = DrawnHarmonic(0.0, 0.0, 0.0)
"""Sample that is replayed before there is any: the cup stays where it is."""


class HarmonicPolicy(BinActor):
    """Policy of one harmonic, its action held by ``learn.decision`` on the bins of ``learn.grid``."""

    table = None

    def __init__(self, artifact: PolicyArtifact, settings: LearnSettings) -> None:
        """Check that the artifact holds one harmonic; raises ValueError if not."""
        super().__init__(settings)
        self.play(_harmonic_of(artifact))

    def play(self, sampled: DrawnHarmonic) -> None:
        """Begin a rollout that replays ``sampled``."""
        self._drawn = sampled
        self._harmonic = Harmonic(self._settings, sampled)
        self._let_go()

    def begin_rollout(self) -> None:
        """Begin the same harmonic anew."""
        self.play(self._drawn)

    def _decide(self, held: HeldAction, row: int, state: SwingState, t_s: float) -> float:
        held.hold(row, self._harmonic.action(t_s, state, held.action), t_s)
        return self._settings.actions_m_s2[held.action]


class RandomReplayLearner(RolloutLearner):
    """Samples harmonics until one succeeds, and replays that one; or, as ``random``, always samples. See the module."""

    def __init__(self, settings: LearnSettings, policy: PolicyArtifact | None = None) -> None:
        """Start from nothing, or from the harmonic of a ``policy``, which counts as one that succeeded."""
        self._settings = settings
        self.count = LearningCount(succeeded_ever=policy is not None)
        self._replayed = STILL if policy is None else _harmonic_of(policy)
        self._best, self._best_streak = self._replayed, 0
        self._present = self._replayed
        self._actor = HarmonicPolicy(_sealed(self._replayed, settings), settings)
        self._rollout = RewardedActor(self._actor, settings.reward)
        self._explored = False

    @classmethod
    def from_state(cls, settings: LearnSettings, state: Mapping[str, Any]) -> Self:
        """Return the learner that ``state()`` described, between the same two rollouts."""
        learner = cls(settings)
        learner._restore(state)
        return learner

    def _restore(self, state: Mapping[str, Any]) -> None:
        self.count = LearningCount(**state["count"])
        self._replayed = DrawnHarmonic(*state["replayed"])
        self._best, self._best_streak = DrawnHarmonic(*state["best"]), int(state["best_streak"])

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts, as JSON values."""
        return {
            "count": dataclasses.asdict(self.count),
            "replayed": list(self._replayed),
            "best": list(self._best),
            "best_streak": self._best_streak,
        }

    @property
    def policy(self) -> PolicyArtifact:
        """The harmonic that is replayed, unless an earlier one had the longer streak of successes while frozen."""
        longer = self._best_streak > self.count.streak
        return _sealed(self._best if longer else self._replayed, self._settings)

    def begin_rollout(self, rng: Generator) -> None:
        """Replay a harmonic, or sample one from ``rng``."""
        own = self._settings.learner
        if isinstance(own, RandomReplaySettings):
            self._explored = explores(own.after_failure, self.count, rng)
            self._present = draw_harmonic(self._settings, rng) if self._explored else self._replayed
        else:
            frozen = self.count.frozen(self._settings.count)
            self._present = self._replayed if frozen else draw_harmonic(self._settings, rng)
            self._replayed = self._present
        self._actor.play(self._present)
        self._rollout = RewardedActor(self._actor, self._settings.reward)

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Keep a sampled harmonic that succeeded, and count; ``state`` is the last reading."""
        success, reward = outcome == "goal", self._rollout.reward(outcome, state, miss_m)
        longer = max(self._settings.count.learned_streak, self._best_streak + 1)
        if not (success or self._explored) and self.count.streak >= longer:
            self._best, self._best_streak = self._replayed, self.count.streak
        if self._explored and (success or not self.count.succeeded_ever):
            self._replayed = self._present
        self.count = self.count.after(explored=self._explored, success=success, settings=self._settings.count)
        return FinishedRollout(self.count.rollouts, self._explored, success, reward, self._rollout.decisions)


def _sealed(sampled: DrawnHarmonic, settings: LearnSettings) -> PolicyArtifact:
    return PolicyArtifact.seal(settings.learner.kind, _meaning(settings), {"harmonic": np.array(sampled)})


def _harmonic_of(artifact: PolicyArtifact) -> DrawnHarmonic:
    values: Array = artifact.array("harmonic")
    if values.shape != (3,):
        raise ValueError(f"the harmonic has shape {values.shape}; allowed: (3,), frequency, amplitude and phase")
    return DrawnHarmonic(*values.tolist())


def _meaning(settings: LearnSettings) -> Mapping[str, object]:
    """Return the settings that give a harmonic its meaning: the task, and the way that it drives the cup."""
    return {
        **task_meaning(settings),
        "drives_place": drives_place(settings),
        "bang_bang": settings.harmonic.bang_bang,
    }


RANDOM_REPLAY = LearnerMaker(
    begin=RandomReplayLearner, resume=RandomReplayLearner.from_state, policy=HarmonicPolicy, meaning=_meaning
)
"""The kind ``random_replay``."""
RANDOM = RANDOM_REPLAY
"""The kind ``random``."""
