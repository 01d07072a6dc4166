"""Model-based: a model of the swing is fitted to the rollouts so far, and a swing that is found in it is played.

The model (``swing_model.py``) is linear in what it learns and assumes no pendulum; a swing is that of ``open_loop``, a
harmonic place of the cup whose frequency changes. The first rollouts play swings that are drawn. From then on the swing
of least expected cost, over what the model may still be, is found by CMA-ES in the model (``swing_planner.py``) and
played as the greedy policy; a success keeps it, a failure adds to the model, in which another one is found. So went
PILCO (M. Deisenroth and C. Rasmussen, ICML 2011), with Gaussian processes; as there, the reward of a state is known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.random import Generator

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import BinActor, HeldAction, task_meaning
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.learners.open_loop import SwingLearner, swing_of, wanted
from kendama_cli.plugins.learners.settings import ModelBasedSettings
from kendama_cli.plugins.learners.swing_model import SwingModel
from kendama_cli.plugins.learners.swing_planner import SwingPlanner
from kendama_cli.schema.arrays import Array


class SwingPolicy(BinActor):
    """Policy of one swing, its acceleration held by ``learn.decision`` on the bins of ``learn.grid``."""

    table = None

    def __init__(self, artifact: PolicyArtifact, settings: LearnSettings) -> None:
        """Raise ValueError if the artifact does not hold one swing."""
        super().__init__(settings)
        self.play(swing_of(artifact))

    def play(self, swing: Array) -> None:
        """Begin a rollout that plays ``swing`` (3,)."""
        self._swing = swing
        frequency, chirp, amplitude = swing.tolist()
        self._numbers = frequency, chirp, amplitude
        self._let_go()
        self.times_s: list[float] = []
        self.readings: list[SwingState] = []

    def begin_rollout(self) -> None:
        """Begin the same swing anew."""
        self.play(self._swing)

    def _decide(self, held: HeldAction, row: int, state: SwingState, t_s: float) -> float:
        """Follow the swing; the ball's reading says only when it changes."""
        actions = self._settings.actions_m_s2
        held.hold(row, held.action, t_s)
        self.times_s.append(t_s)
        self.readings.append(state)
        asked = wanted(self._numbers, t_s, state.x_m, state.velocity_m_s, self._settings.decision.max_s)
        return max(actions[0], min(actions[-1], asked))


class ModelBasedLearner(SwingLearner):
    """Learner that fits a model to the rollouts so far, and plays what a search finds in it. See the module."""

    _actor: SwingPolicy

    def __init__(self, settings: LearnSettings, policy: PolicyArtifact | None = None) -> None:
        """Start from nothing, or from the swing of a ``policy``, which is played until it fails."""
        assert isinstance(settings.learner, ModelBasedSettings)
        super().__init__(settings, np.zeros(3), policy, SwingPolicy)
        self._own, noise = settings.learner, settings.noise
        self._model = SwingModel(math.radians(noise.angle_reading_deg), noise.rate_reading_rad_s)
        self._planner = SwingPlanner(settings)
        self._plans, self._seen = policy is None, 0

    def _restore(self, state: Mapping[str, Any]) -> None:
        super()._restore(state)
        self._plans, self._seen = bool(state["plans"]), int(state["seen"])
        self._model.gram, self._model.moment = np.array(state["gram"]), np.array(state["moment"])
        self._model.squares, self._model.equations = float(state["squares"]), int(state["equations"])

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts: the model's normal equations, and JSON values."""
        return {
            **super().state(),
            "seen": self._seen,
            "plans": self._plans,
            "gram": np.array(self._model.gram),
            "moment": np.array(self._model.moment),
            "squares": self._model.squares,
            "equations": self._model.equations,
        }

    def begin_rollout(self, rng: Generator) -> None:
        """Play a drawn swing, the last one that was found, or another one that ``rng`` helps to find."""
        self._explored = self._plans and self._seen < self._own.sampled_rollouts
        if self._plans and not self._explored:
            self._greedy = self._planner.found(self._model, self._greedy if self._greedy.any() else None, rng)
        self._play(self._planner.drawn(rng) if self._explored else self._greedy)

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Add the readings to the model and count; ``state`` is the last reading."""
        success, reward = outcome == "goal", self._rollout.reward(outcome, state, miss_m)
        if not self.count.frozen(self._settings.count):
            self._model.add(self._actor.times_s, self._actor.readings)
            self._seen += 1
        self._plans = self._explored or not success
        return self._counted(reward, success=success)


MODEL_BASED = LearnerMaker(
    begin=ModelBasedLearner, resume=ModelBasedLearner.from_state, policy=SwingPolicy, meaning=task_meaning
)
"""The kind ``model_based``."""
