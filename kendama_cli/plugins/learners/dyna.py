"""Dyna on a table: beside every real transition, some that a learned model imagines (R. Sutton, 1990).

The real ones are learned from as ``sarsa`` learns, with its traces and exploration. After each the model, which holds
what the choices in these bins led to, is asked for ``learn.learner.planning`` transitions that it has seen, and each
backs one value up by one step:

    q      Q(s, a) += alpha [r + gamma max_b Q(s', b) - Q(s, a)]     Dyna-Q
    sarsa  Q(s, a) += alpha [r + gamma Q(s', a') - Q(s, a)]          Dyna-SARSA: a' is what was chosen then
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import GreedyPolicy, task_meaning
from kendama_cli.learning.interface import LearnerMaker
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.updates import Transition
from kendama_cli.plugins.learners.settings import DynaSettings

ENDED = -1
"""The next row where the rollout ended."""


class TransitionModel:
    """The last ``outcomes`` transitions of every pair of row and action that was ever chosen.

    It is the sample model of Dyna (Sutton and Barto, 2nd edition, section 8.2) for a task that seems stochastic in
    bins: what it imagines is drawn from what really followed.
    """

    def __init__(self, rows: int, columns: int, outcomes: int) -> None:
        self._columns, self._outcomes = columns, outcomes
        self._led_to = np.full((rows * columns, outcomes, 2), ENDED)
        self._rewards = np.zeros((rows * columns, outcomes))
        self._seen = np.zeros(rows * columns, dtype=np.int64)
        self._pairs: list[int] = []

    def state(self) -> dict[str, NDArray[Any]]:
        """Return the state to save: the outcomes of the pairs that were chosen, in the order of their first choice."""
        pairs = np.array(self._pairs, dtype=np.int64)
        return {
            "model_pairs": pairs,
            "model_seen": self._seen[pairs],
            "model_led_to": self._led_to[pairs],
            "model_rewards": self._rewards[pairs],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Become what ``state()`` described."""
        pairs = np.asarray(state["model_pairs"], dtype=np.int64)
        self._pairs = pairs.tolist()
        for mine, name in ((self._seen, "seen"), (self._led_to, "led_to"), (self._rewards, "rewards")):
            mine[pairs] = state[f"model_{name}"]

    def add(self, transition: Transition) -> None:
        """Remember a transition; of a pair that was chosen more than ``outcomes`` times the oldest is forgotten."""
        pair = transition.row * self._columns + transition.column
        if not self._seen[pair]:
            self._pairs.append(pair)
        slot = self._seen[pair] % self._outcomes
        row, column = transition.next_row, transition.next_column
        self._led_to[pair, slot] = (ENDED, ENDED) if row is None else (row, column)
        self._rewards[pair, slot] = transition.reward
        self._seen[pair] += 1

    def imagined(self, n: int, rng: Generator) -> Iterator[Transition]:
        """Yield ``n`` transitions: of a pair that was chosen before, what followed it once."""
        pairs = np.array(self._pairs)[rng.integers(len(self._pairs), size=n)]
        slots = (rng.random(n) * np.minimum(self._seen[pairs], self._outcomes)).astype(np.int64)
        led_to, rewards = self._led_to[pairs, slots].tolist(), self._rewards[pairs, slots].tolist()
        for pair, (row, column), reward in zip(pairs.tolist(), led_to, rewards, strict=True):
            ended = row == ENDED
            begun, chosen = divmod(pair, self._columns)
            yield Transition(begun, chosen, reward, None if ended else row, None if ended else column)


class DynaLearner(SarsaLearner):
    """SARSA(lambda) on a table that also learns from a model's transitions. See the module."""

    def __init__(self, settings: LearnSettings, *, q: NDArray[np.float64] | None = None) -> None:
        super().__init__(settings, q=q)
        assert isinstance(settings.learner, DynaSettings)
        self._own = settings.learner
        self._model = TransitionModel(self._grid.n_states, len(settings.actions_m_s2), self._own.outcomes)
        self._planning_rng: Generator | None = None

    @classmethod
    def from_state(cls, settings: LearnSettings, state: Mapping[str, Any]) -> Self:
        """Rebuild the learner that ``state()`` described, between the same two rollouts."""
        learner = super().from_state(settings, state)
        learner._model.restore(dict(state))
        return learner

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts: table, model and JSON values."""
        return {**super().state(), **self._model.state()}

    def begin_rollout(self, rng: Generator) -> None:
        """Decide whether this rollout explores; ``rng`` also draws what is imagined."""
        super().begin_rollout(rng)
        self._planning_rng = rng

    def _learn(self, transition: Transition) -> None:
        super()._learn(transition)
        if not self._alpha:  # frozen: neither table nor model learns
            return
        assert self._planning_rng is not None
        self._model.add(transition)
        for imagined in self._model.imagined(self._own.planning, self._planning_rng):
            self._values.back_up(imagined, self._own.planning_alpha * self._alpha, self._own.backup)


def _begin(settings: LearnSettings, policy: PolicyArtifact | None) -> DynaLearner:
    return DynaLearner(settings, q=None if policy is None else policy.array("q"))


DYNA = LearnerMaker(begin=_begin, resume=DynaLearner.from_state, policy=GreedyPolicy, meaning=task_meaning)
"""The kind ``dyna``."""
