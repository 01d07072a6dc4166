"""SARSA(lambda) and its kin: temporal differences with eligibility traces on a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import GreedyPolicy, checked_table, task_meaning
from kendama_cli.learning.interface import LearnerMaker
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.updates import TRACES, UPDATES, TraceName, Transition, UpdateName
from kendama_cli.learning.value_learner import ValueLearner


class ValueTable:
    """Q += alpha [r + gamma V - Q(s, a)] e (equations.md eq. 6, 7); V and e of the chosen update and traces.

    With dutch traces the error is taken from Q_old(s, a), the value looked ahead to before the last update, and
    alpha (Q_old(s, a) - Q(s, a)) is added to the entry of the state (true online Sarsa(lambda), Sutton and Barto, 2nd
    edition, section 12.7). Of two tables each has traces of its own, marked where it was the one to learn; earlier
    choices share in the other table's own error r + gamma V - Q2(s, a), so that lambda = 1 gives the return here too.
    """

    def __init__(
        self,
        q: NDArray[np.float64],
        *,
        gamma: float,
        trace_decay: float,
        traces: TraceName = "replacing",
        update: UpdateName = "sarsa",
    ) -> None:
        """Store ``q``: (states, actions), or one such table for each that the update has."""
        self._update = UPDATES[update]
        single = np.asarray(q, dtype=np.float64)
        self._tables = np.array(single if single.ndim == 3 else [single] * self._update.tables)
        self._gamma = gamma
        self._fading = gamma * trace_decay
        self._law = TRACES[traces]
        self._traces = np.zeros_like(self._tables)
        self._change = np.empty_like(self._tables[0])
        self._expected: float | None = None

    @property
    def q(self) -> NDArray[np.float64]:
        """The latest table (states, actions): the mean of all there are. Not to be written to."""
        return self._tables[0] if len(self._tables) == 1 else np.asarray(self._tables.mean(axis=0))

    @property
    def tables(self) -> NDArray[np.float64]:
        """All that was learned: a copy of the table, or of the tables (n, states, actions)."""
        return np.array(self._tables[0] if len(self._tables) == 1 else self._tables)

    def values(self, q: NDArray[np.float64], row: int) -> list[float]:
        """Return the values of one row of ``q``, or of a mean of such tables."""
        found: list[float] = q[row].tolist()
        return found

    def begin(self) -> None:
        """Forget all traces: a new rollout owes nothing to the last."""
        self._traces.fill(0.0)
        self._expected = None

    def update(self, transition: Transition, alpha: float, coin: float = 0.0) -> float:
        """Learn from one transition; returns the temporal-difference error before the update.

        ``coin`` in [0, 1) draws the table that learns from this choice; it matters only where there are several.
        """
        learning = int(coin * len(self._tables))
        if len(self._tables) > 1:
            return self._update_pair(transition, alpha, learning)
        q, traces = self._tables[0], self._traces[0]
        entry = transition.row, transition.column
        value = float(q[entry])
        old = value if self._expected is None or not self._law.exact else self._expected
        ahead, goes_on = 0.0, True
        if transition.next_row is not None:
            ahead = self._update.ahead(q, transition)
            goes_on = self._update.goes_on(q, transition)
            self._expected = float(q[transition.next_row, transition.next_column])
        error = transition.reward + self._gamma * ahead - old
        traces *= self._fading
        traces[entry] = self._law.marked(float(traces[entry]), alpha)
        q += np.multiply(traces, alpha * error, out=self._change)
        if self._law.exact:
            q[entry] += alpha * (old - value)
        if not goes_on:
            self.begin()
        return error

    def back_up(self, transition: Transition, alpha: float, update: UpdateName) -> None:
        """Learn from one imagined transition, by the target of ``update``: one step, and traces stay what they are."""
        entry = transition.row, transition.column
        for q in self._tables:
            ahead = 0.0 if transition.next_row is None else UPDATES[update].ahead(q, transition)
            q[entry] += alpha * (transition.reward + self._gamma * ahead - q[entry])

    def _update_pair(self, transition: Transition, alpha: float, learning: int) -> float:
        entry = transition.row, transition.column
        values = [float(q[entry]) for q in self._tables]
        ended = transition.next_row is None
        aheads = [0.0 if ended else self._gamma * self._update.ahead(q, transition) for q in self._tables]
        self._traces *= self._fading
        self._traces[learning][entry] = self._law.marked(float(self._traces[learning][entry]), alpha)
        for table in range(2):
            error = transition.reward + aheads[1 - table] - values[1 - table]
            self._tables[table] += np.multiply(self._traces[table], alpha * error, out=self._change)
        self._tables[learning][entry] += alpha * (values[1 - learning] - values[learning])
        return transition.reward + aheads[1 - learning] - values[learning]


class SarsaLearner(ValueLearner):
    """SARSA(lambda), or another of ``learn.update``, on a table (states, actions)."""

    _values: ValueTable

    def _begin_values(self, q: NDArray[np.float64] | None) -> ValueTable:
        settings = self._settings
        shape = (self._grid.n_states, len(settings.actions_m_s2))
        start = np.full(shape, settings.initial_q) if q is None else np.asarray(q, dtype=np.float64)
        for table in start if start.ndim == 3 else (start,):
            checked_table(table, settings)
        return ValueTable(
            start,
            gamma=settings.gamma,
            trace_decay=settings.trace_decay,
            traces=settings.traces,
            update=settings.update,
        )

    @property
    def table(self) -> NDArray[np.float64]:
        """A copy of the table (states, actions)."""
        return np.array(self._values.q)


def _begin(settings: LearnSettings, policy: PolicyArtifact | None) -> SarsaLearner:
    return SarsaLearner(settings, q=None if policy is None else policy.array("q"))


SARSA = LearnerMaker(begin=_begin, resume=SarsaLearner.from_state, policy=GreedyPolicy, meaning=task_meaning)
"""The kind ``sarsa``."""
