"""A hand-written energy pump: the controller that a learner is to be compared with. It learns nothing."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.random import Generator

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import BinActor, HeldAction, task_meaning
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.rewarded_actor import RewardedActor, RolloutLearner
from kendama_cli.learning.settings import EnergyPumpingSettings, LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount

ROPE_M = 0.4
"""Length of the pendulum whose energy is computed [m]; a policy does not know the rope that it will hang on."""
GRAVITY_M_S2 = 9.81


class EnergyPumpingPolicy(BinActor):
    """The law of EnergyPumpingSettings, its acceleration held by ``learn.decision`` on the bins of ``learn.grid``."""

    table = None

    def __init__(self, artifact: PolicyArtifact, settings: LearnSettings) -> None:
        """Check that the artifact holds the law's constants; raises ValueError if not."""
        values = artifact.array("constants")
        names = [entry.name for entry in dataclasses.fields(EnergyPumpingSettings) if entry.name != "kind"]
        if values.shape != (len(names),):
            raise ValueError(f"the pump has constants of shape {values.shape}; allowed: ({len(names)},)")
        self._law = EnergyPumpingSettings("energy_pumping", *values.tolist())
        super().__init__(settings)

    def begin_rollout(self) -> None:
        """Forget the last acceleration."""
        self._let_go()

    def _decide(self, held: HeldAction, row: int, state: SwingState, t_s: float) -> float:
        held.hold(row, held.action, t_s)
        return self._wanted(state)

    def _wanted(self, state: SwingState) -> float:
        law, settings = self._law, self._settings
        x_m, velocity_m_s, angle, rate = state
        energy = GRAVITY_M_S2 * ROPE_M * (1.0 - math.cos(angle)) + 0.5 * (ROPE_M * rate) ** 2
        missing = GRAVITY_M_S2 * ROPE_M * (1.0 + law.height) - energy
        gain = law.gain * (1.0 if missing > 0.0 else law.braking)
        pumped = -gain * missing * math.cos(angle - math.copysign(law.lead_rad, rate)) * math.copysign(1.0, rate)
        desired = pumped - law.stiffness_per_s2 * x_m - law.damping_per_s * velocity_m_s
        return max(settings.actions_m_s2[0], min(settings.actions_m_s2[-1], desired))


class EnergyPumpingLearner(RolloutLearner):
    """Acts by the pump in every rollout, and counts."""

    def __init__(self, settings: LearnSettings, policy: PolicyArtifact | None = None) -> None:
        self._settings = settings
        self.count = LearningCount(succeeded_ever=True)
        self.policy = _sealed(settings) if policy is None else policy
        self._actor = EnergyPumpingPolicy(self.policy, settings)
        self._rollout = RewardedActor(self._actor, settings.reward)

    @classmethod
    def from_state(cls, settings: LearnSettings, state: Mapping[str, Any]) -> EnergyPumpingLearner:
        """Return the learner that ``state()`` described, between the same two rollouts."""
        policy = PolicyArtifact.seal(
            "energy_pumping", task_meaning(settings), {"constants": np.array(state["constants"])}
        )
        learner = cls(settings, policy)
        learner.count = LearningCount(**state["count"])
        return learner

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts, as JSON values."""
        return {"count": dataclasses.asdict(self.count), "constants": self.policy.array("constants").tolist()}

    def begin_rollout(self, rng: Generator) -> None:
        """Begin to pump; nothing is drawn."""
        self._actor.begin_rollout()
        self._rollout = RewardedActor(self._actor, self._settings.reward)

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Count the rollout; ``state`` is the last reading."""
        success, reward = outcome == "goal", self._rollout.reward(outcome, state, miss_m)
        self.count = self.count.after(explored=False, success=success, settings=self._settings.count)
        return FinishedRollout(self.count.rollouts, False, success, reward, self._rollout.decisions)


def _sealed(settings: LearnSettings) -> PolicyArtifact:
    own = settings.learner
    assert isinstance(own, EnergyPumpingSettings)
    constants = [value for name, value in dataclasses.asdict(own).items() if name != "kind"]
    return PolicyArtifact.seal("energy_pumping", task_meaning(settings), {"constants": np.array(constants)})


ENERGY_PUMPING = LearnerMaker(
    begin=EnergyPumpingLearner, resume=EnergyPumpingLearner.from_state, policy=EnergyPumpingPolicy, meaning=task_meaning
)
"""The kind ``energy_pumping``."""
