"""An actor that learns nothing, and the reward that its decisions bring: what baselines and controllers share."""

from __future__ import annotations

from typing import Protocol

from kendama_cli.learning.reward import Outcome, final_reward, step_reward
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import RewardSettings


class CountingActor(Protocol):
    """Acts in one rollout and counts how often it decided."""

    @property
    def decisions(self) -> int:
        """Decisions of this rollout so far."""

    @property
    def next_look_s(self) -> float:
        """``act`` changes nothing before this time into the rollout [s]."""

    def act(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration [m/s^2] at ``t_s`` into the rollout."""


class RewardedActor:
    """One rollout of ``actor``: each decision but the first is rewarded for the cup's position that it finds."""

    def __init__(self, actor: CountingActor, settings: RewardSettings) -> None:
        self._actor = actor
        self._settings = settings
        self._reward = 0.0

    @property
    def decisions(self) -> int:
        """Decisions so far."""
        return self._actor.decisions

    @property
    def next_look_s(self) -> float:
        """``act`` changes nothing before this time into the rollout [s]."""
        return self._actor.next_look_s

    def act(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration [m/s^2] at ``t_s`` into the rollout."""
        before = self._actor.decisions
        acceleration = self._actor.act(state, t_s)
        if self._actor.decisions > before > 0:
            self._reward += step_reward(self._settings, state.x_m)
        return acceleration

    def reward(self, outcome: Outcome, state: SwingState, miss_m: float | None) -> float:
        """Return the whole rollout's reward, ended by ``outcome`` at the last reading ``state``."""
        if not self._actor.decisions:
            return 0.0
        return self._reward + step_reward(self._settings, state.x_m) + final_reward(self._settings, outcome, miss_m)


class RolloutLearner:
    """Learner that acts by a RewardedActor, made anew for every rollout, and keeps no table."""

    table = None
    decides_on_bins = True
    _rollout: RewardedActor

    @property
    def next_look_s(self) -> float:
        """``act`` changes nothing before this time into the rollout, so no reading is needed before it [s]."""
        return self._rollout.next_look_s

    def act(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration [m/s^2] at ``t_s`` into the rollout."""
        return self._rollout.act(state, t_s)
