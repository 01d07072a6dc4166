"""SARSA(lambda) and Watkins' Q(lambda): temporal differences with eligibility traces on a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import GreedyPolicy, checked_table, task_meaning
from kendama_cli.learning.interface import LearnerMaker
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.updates import Transition, UpdateName, ahead, keeps_traces
from kendama_cli.learning.value_learner import ValueLearner


class ValueTable:
    """Q += alpha [r + gamma V - Q(s, a)] e (equations.md eq. 6, 7), with V of the chosen update.

    The traces e are replacing ones (S. Singh and R. Sutton, Machine Learning 22, 1996): all fade by gamma lambda, then
    that of the visited entry becomes 1. With ``by_state``, a visit also ends the traces of the state's other actions.
    """

    def __init__(
        self,
        q: NDArray[np.float64],
        *,
        gamma: float,
        trace_decay: float,
        update: UpdateName = "sarsa",
        by_state: bool = False,
    ) -> None:
        """Store a copy of ``q`` (states, actions)."""
        self.q: NDArray[np.float64] = np.array(q, dtype=np.float64)
        """The latest table. Not to be written to."""
        self._update, self._gamma, self._fading, self._by_state = update, gamma, gamma * trace_decay, by_state
        self._traces, self._change = np.zeros_like(self.q), np.empty_like(self.q)

    @property
    def tables(self) -> NDArray[np.float64]:
        """A copy of all that was learned."""
        return np.array(self.q)

    def values(self, q: NDArray[np.float64], row: int) -> list[float]:
        """Return the values of one row of ``q``, or of a mean of such tables."""
        found: list[float] = q[row].tolist()
        return found

    def begin(self) -> None:
        """Forget all traces: a new rollout owes nothing to the last."""
        self._traces.fill(0.0)

    def update(self, transition: Transition, alpha: float) -> float:
        """Learn from one transition; return the temporal-difference error before the update."""
        row, column, reward, next_row, next_column = transition
        following, kept = 0.0, True
        if next_row is not None and next_column is not None:
            following = ahead(self._update, self.q, next_row, next_column)
            kept = keeps_traces(self._update, self.q, next_row, next_column)
        error = reward + self._gamma * following - float(self.q[row, column])
        self._traces *= self._fading
        if self._by_state:
            self._traces[row] = 0.0
        self._traces[row, column] = 1.0
        self.q += np.multiply(self._traces, alpha * error, out=self._change)
        if not kept:
            self.begin()
        return error

    def back_up(self, transition: Transition, alpha: float, update: UpdateName) -> None:
        """Learn from one imagined transition, by the target of ``update``: one step, and traces stay what they are."""
        row, column, reward, next_row, next_column = transition
        following = 0.0
        if next_row is not None and next_column is not None:
            following = ahead(update, self.q, next_row, next_column)
        self.q[row, column] += alpha * (reward + self._gamma * following - self.q[row, column])


class SarsaLearner(ValueLearner):
    """SARSA(lambda), or another of ``learn.update``, on a table (states, actions)."""

    _values: ValueTable

    def _begin_values(self, q: NDArray[np.float64] | None) -> ValueTable:
        settings = self._settings
        shape = (self._grid.n_states, len(settings.actions_m_s2))
        start = np.full(shape, settings.initial_q) if q is None else np.asarray(q, dtype=np.float64)
        return ValueTable(
            checked_table(start, settings),
            gamma=settings.gamma,
            trace_decay=settings.trace_decay,
            update=settings.update,
            by_state=settings.traces == "state",
        )

    @property
    def table(self) -> NDArray[np.float64]:
        """A copy of the table (states, actions)."""
        return np.array(self._values.q)


def _begin(settings: LearnSettings, policy: PolicyArtifact | None) -> SarsaLearner:
    return SarsaLearner(settings, q=None if policy is None else policy.array("q"))


SARSA = LearnerMaker(begin=_begin, resume=SarsaLearner.from_state, policy=GreedyPolicy, meaning=task_meaning)
"""The kind ``sarsa``."""
