"""Baseline: SARSA's own explorer without a table: the harmonic of the highest reward so far is replayed.

It differs from ``random_replay`` by the memory of ``learn.exploration``: new harmonics mutate the best ones. What
``sarsa`` needs fewer rollouts for, it owes to its table.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

from numpy.random import Generator

from kendama_cli.learning.exploration import DrawnHarmonic, Harmonic, explorer, explores
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.random_replay import RANDOM_REPLAY, HarmonicPolicy, RandomReplayLearner
from kendama_cli.learning.reward import Outcome, final_reward
from kendama_cli.learning.rewarded_actor import RewardedActor
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState


class EliteLearner(RandomReplayLearner):
    """Samples and mutates harmonics as ``sarsa`` explores, and replays the best one."""

    _elite: tuple[tuple[float, DrawnHarmonic], ...] = ()

    @classmethod
    def from_state(cls, settings: LearnSettings, state: Mapping[str, Any]) -> Self:
        """Return the learner that ``state()`` described, between the same two rollouts."""
        learner = cls(settings)
        learner._restore(state)
        learner._elite = tuple((reward, DrawnHarmonic(*sampled)) for reward, *sampled in state["elite"])
        return learner

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts, as JSON values."""
        return {**super().state(), "elite": [[reward, *sampled] for reward, sampled in self._elite]}

    def begin_rollout(self, rng: Generator) -> None:
        """Replay the best harmonic, or explore by ``rng``."""
        settings = self._settings.exploration
        self._explored = explores(settings.after_failure, self.count, rng, in_a_row=settings.in_a_row)
        self._present = self._replayed
        if self._explored:
            sampled = explorer(self._settings, self.count, [harmonic for _, harmonic in self._elite], rng)
            assert isinstance(sampled, Harmonic)
            self._present = sampled.drawn
        self._actor.play(self._present)
        self._rollout = RewardedActor(self._actor, self._settings.reward)

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Keep a harmonic that was rewarded, and count; ``state`` is the last reading."""
        final = final_reward(self._settings.reward, outcome, miss_m)
        finished = super().end_rollout(outcome, state, miss_m)
        if finished.explored and final > 0.0:
            ranked = sorted([(final, self._present), *self._elite], key=lambda one: -one[0])
            self._elite = tuple(ranked[: self._settings.exploration.elite_size])
            self._replayed = self._elite[0][1]
        return finished


ELITE = LearnerMaker(
    begin=EliteLearner, resume=EliteLearner.from_state, policy=HarmonicPolicy, meaning=RANDOM_REPLAY.meaning
)
"""The kind ``elite``."""
