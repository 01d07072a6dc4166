"""SARSA(lambda) on a table: the update alone, for any task with numbered states and actions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kendama_cli.learning.traces import Traces, visited


class Transition(NamedTuple):
    """One choice and what came of it; ``next_row`` is None where the rollout ended."""

    row: int
    column: int
    reward: float
    next_row: int | None
    next_column: int | None


class SarsaTable:
    """Q(s_t, a_t) += alpha [r_t + gamma Q(s_t+1, a_t+1) - Q(s_t, a_t)] e(s) (PAPER.md eq. 6 and 7)."""

    def __init__(self, q: NDArray[np.float64], *, gamma: float, trace_decay: float, traces: Traces) -> None:
        self.q = np.array(q, dtype=np.float64)
        self._gamma = gamma
        self._fading = gamma * trace_decay
        self._law: Traces = traces
        self._traces = np.zeros_like(self.q)

    def begin(self) -> None:
        """Forget all traces: a new rollout owes nothing to the last."""
        self._traces = np.zeros_like(self.q)

    def update(self, transition: Transition, alpha: float) -> float:
        """Learn from one transition; returns the temporal-difference error before the update."""
        row, column, reward, next_row, next_column = transition
        ahead = 0.0 if next_row is None else float(self.q[next_row, next_column])
        error = reward + self._gamma * ahead - float(self.q[row, column])
        self._traces = visited(self._traces, row, column, law=self._law, fading=self._fading, alpha=alpha)
        self.q += (alpha * error) * self._traces
        return error
