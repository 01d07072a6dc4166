"""Dyna on a table: beside every real transition, some that a learned model imagines (R. Sutton, 1990).

The real ones are learned from as ``sarsa`` learns, with its traces and exploration. After each the model, which holds
what the choices in these bins led to, is asked for ``learn.learner.planning`` transitions that it has seen, and each
backs one value up by one step:

    q      Q(s, a) += alpha [r + gamma max_b Q(s', b) - Q(s, a)]     Dyna-Q
    sarsa  Q(s, a) += alpha [r + gamma Q(s', a') - Q(s, a)]          Dyna-SARSA: a' is what was chosen then
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.interface import LearnerMaker
from kendama_cli.learning.learner_settings import DynaSettings
from kendama_cli.learning.policy import GreedyPolicy, task_meaning
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.transition_model import TransitionModel
from kendama_cli.learning.updates import Transition


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
        """The learner that ``state()`` described, between the same two rollouts."""
        learner = super().from_state(settings, state)
        learner._model.restore(dict(state))
        return learner

    def state(self) -> dict[str, Any]:
        """The learner between two rollouts: table, model and JSON values."""
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
