"""SARSA(lambda) and its kin on a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.interface import LearnerMaker
from kendama_cli.learning.policy import GreedyPolicy, checked_table, task_meaning
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.temporal_difference import ValueTable
from kendama_cli.learning.value_learner import ValueLearner


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
