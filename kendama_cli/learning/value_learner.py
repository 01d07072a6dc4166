"""Learning the values of actions, driven from outside: the same object learns in simulation and on hardware.

The values are kept in a table (``sarsa.py``), or in what another learner brings.
"""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any, Protocol, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import BinActor, HeldAction, greedy_column, seal_table
from kendama_cli.learning.exploration import DrawnHarmonic, Explorer, Harmonic, explorer, explores
from kendama_cli.learning.interface import FinishedRollout
from kendama_cli.learning.reward import Outcome, final_reward, step_reward
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount
from kendama_cli.learning.updates import Transition


class Acting:
    """The values to act by: the latest, or the mean of those after each success in a row so far.

    A large learning rate makes each table differ from the last, and the mean of several is nearer to what they vary
    about (iterate averaging: Polyak and Juditsky 1992, https://doi.org/10.1137/0330046). A failure, which is there to
    be learned from, ends the mean. The longest streak's values are kept, since those that came after may be worse.
    """

    def __init__(self, q: NDArray[np.float64], *, averaged: bool) -> None:
        self._mean = np.array(q) if averaged else None
        self._best, self._best_streak = np.array(q), 0

    def by(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values to act by if ``q`` are the latest values; not to be written to."""
        return q if self._mean is None else self._mean

    def handed_over(self, q: NDArray[np.float64], count: LearningCount) -> NDArray[np.float64]:
        """Return the present values, unless frozen earlier ones had the longer streak of greedy successes."""
        return self._best if self._best_streak > count.streak else self.by(q)

    def ended(
        self, q: NDArray[np.float64], before: LearningCount, after: LearningCount, *, learned: bool, streak: int
    ) -> None:
        """Take note of a rollout that made ``after`` of ``before``; ``streak`` successes in a row freeze the values."""
        if after.greedy_failed and before.streak >= max(streak, self._best_streak + 1):
            # what is frozen is still what made the streak that ends here
            self._best, self._best_streak = np.array(self.by(q)), before.streak
        if self._mean is not None and learned:
            self._mean += (q - self._mean) / max(1, after.streak)

    def state(self) -> dict[str, Any]:
        """Return the state to save, between two rollouts."""
        mean = {} if self._mean is None else {"mean": np.array(self._mean)}
        return {"best": np.array(self._best), "best_streak": self._best_streak, **mean}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what ``state()`` described."""
        self._best, self._best_streak = np.asarray(state["best"]), int(state["best_streak"])
        if self._mean is not None:
            self._mean = np.array(state["mean"])


class Values(Protocol):
    """Values of the actions by row, and how they learn from a choice."""

    @property
    def q(self) -> NDArray[np.float64]:
        """The latest values (rows, actions). Not to be written to."""

    @property
    def tables(self) -> NDArray[np.float64]:
        """A copy of all that was learned."""

    def values(self, q: NDArray[np.float64], row: int) -> list[float]:
        """Return the values of the actions in ``row``, of ``q`` or of a mean of such tables."""

    def begin(self) -> None:
        """Forget all traces."""

    def update(self, transition: Transition, alpha: float) -> float:
        """Learn from one transition; returns the temporal-difference error."""


class ValueLearner(BinActor, abc.ABC):
    """Temporal differences on values: ``begin_rollout``, ``act`` as often as there are readings, ``end_rollout``.

    An action is held until the binned state changes, at least ``decision.min_s`` and at most
    ``decision.max_s``; only these decisions are learned from. Between rollouts ``state()`` is all there is to
    save, and ``from_state`` resumes from it bit for bit.
    """

    def __init__(self, settings: LearnSettings, *, q: NDArray[np.float64] | None = None) -> None:
        super().__init__(settings)
        self._values = self._begin_values(q)
        self.count = LearningCount(succeeded_ever=q is not None)
        self._acting = Acting(self._values.q, averaged=settings.acting == "streak_mean")
        self._explorer: Explorer | None = None
        self._lucky: list[tuple[float, DrawnHarmonic]] = []
        self._alpha = settings.alpha
        self._reward = 0.0
        self._transitions: list[Transition] = []

    @abc.abstractmethod
    def _begin_values(self, q: NDArray[np.float64] | None) -> Values:
        """Return the values at the start, or those of ``q``."""

    @classmethod
    def from_state(cls, settings: LearnSettings, state: Mapping[str, Any]) -> Self:
        """Return the learner that ``state()`` described, between the same two rollouts."""
        learner = cls(settings, q=state["q"])
        learner.count = LearningCount(**state["count"])
        learner._acting.restore(state)
        learner._lucky = [(reward, DrawnHarmonic(*sampled)) for reward, *sampled in state["lucky"]]
        return learner

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts: the values and JSON values."""
        return {
            "q": self._values.tables,
            "count": dataclasses.asdict(self.count),
            "lucky": [[reward, *sampled] for reward, sampled in self._lucky],
            **self._acting.state(),
        }

    @property
    def rollouts(self) -> int:
        """Rollouts finished so far."""
        return self.count.rollouts

    @property
    def explored(self) -> bool:
        """Return True if the present rollout explores, or the last one did."""
        return self._explorer is not None

    @property
    def policy(self) -> PolicyArtifact:
        """The values to act by, sealed with the settings that give them their meaning."""
        return self._sealed(self._acting.handed_over(self._values.q, self.count))

    def _sealed(self, q: NDArray[np.float64]) -> PolicyArtifact:
        return seal_table(q, self._settings)

    def begin_rollout(self, rng: Generator) -> None:
        """Decide whether this rollout explores and draw what it tries; ``rng`` serves until the rollout ends."""
        settings = self._settings.exploration
        explore = explores(settings.after_failure, self.count, rng, in_a_row=settings.in_a_row)
        self._explorer = (
            explorer(self._settings, self.count, [sampled for _, sampled in self._lucky], rng) if explore else None
        )
        fading = 1.0 + self.rollouts / self._settings.alpha_decay_rollouts
        self._alpha = 0.0 if self.count.frozen(self._settings.count) else self._settings.alpha / fading
        self._values.begin()
        self._let_go()
        self._reward = 0.0
        self._transitions = []

    def _decide(self, held: HeldAction, row: int, state: SwingState, t_s: float) -> float:
        values = self._values.values(self._acting.by(self._values.q), row)
        action = held.mirrored(greedy_column(values, held.mirrored(held.action)))
        if self._explorer is not None:
            action = self._explorer.action(t_s, state, action)
        if held.row >= 0:
            reward = step_reward(self._settings.reward, state.x_m)
            self._learn(Transition(held.row, held.column, reward, row, held.mirrored(action)))
        held.hold(row, action, t_s)
        return self._settings.actions_m_s2[action]

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Learn from the end of the rollout and count it; ``state`` is the last reading."""
        rewards = self._settings.reward
        final = final_reward(rewards, outcome, miss_m)
        if self._held.row >= 0:
            reward = step_reward(rewards, state.x_m) + final
            self._learn(Transition(self._held.row, self._held.column, reward, None, None))
        actions = len(self._transitions)
        for _ in range(self._settings.replay_passes if self._alpha else 0):
            self._values.begin()
            for transition in self._transitions:
                self._values.update(transition, self._alpha)
        success = outcome == "goal"
        if final > 0.0 and isinstance(self._explorer, Harmonic):
            self._lucky.insert(0, (final, self._explorer.drawn))
            self._lucky = sorted(self._lucky, key=_first)[: self._settings.exploration.elite_size]
        before, settings = self.count, self._settings.count
        self.count = before.after(explored=self.explored, success=success, settings=settings)
        self._acting.ended(
            self._values.q, before, self.count, learned=bool(self._alpha), streak=settings.learned_streak
        )
        return FinishedRollout(self.count.rollouts, self.explored, success, self._reward, actions)

    def _learn(self, transition: Transition) -> None:
        if self._alpha:
            self._values.update(transition, self._alpha)
        self._transitions.append(transition)
        self._reward += transition.reward


def _first(elite: tuple[float, DrawnHarmonic]) -> float:
    """Return the sort key of stored rollouts: the best reward first, among equal ones the newest."""
    return -elite[0]
