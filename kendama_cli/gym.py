"""The learning environment of the swing-up as a Gymnasium environment (needs the extra ``gym``).

    import gymnasium, kendama_cli.gym
    env = gymnasium.make("kendama/SwingUp-v0")

Importing this module registers it; ``gymnasium.make("kendama_cli.gym:kendama/SwingUp-v0")`` does both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.errors import ConfigError
from kendama_cli.learning.reward import final_reward, step_reward
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.environment import Rolling, SwingUpEnvironment
from kendama_cli.simulation.swingup.rollout import SimulatedRollout

Observation = NDArray[np.float64]
NAME = "kendama/SwingUp-v0"
LARGEST_RATE_RAD_S = 100.0
"""Readings of the ball's angular velocity are cut here; swings stay far below."""


class SwingUp(gymnasium.Env[Observation, np.int64]):
    """Swing the ball up from hanging, by the cup's acceleration along x.

    Observation, float64: cup position x [m], cup velocity [m/s], ball angle about the tie point [rad] (0 hanging,
    positive toward +x, within +-pi), ball angular velocity [rad/s]; the ball's two with the reading noise of
    ``learn.noise``. Action: which of ``learn.actions_m_s2`` [m/s^2] to hold for ``hold_s``. Reward:
    ``learn.reward``, the step's and at the end the final one. Terminated at the release (the flight and the catch
    follow by themselves within that step), or outside where that ends a rollout; truncated after ``learn.rollout_s``.
    At the end ``info`` has outcome, duration_s, half_swings and peak_displacement_m, and success in any case.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - gymnasium's own declaration

    def __init__(self, overrides: Sequence[str] = (), hold_s: float | None = None) -> None:
        """``overrides`` are those of the command line, as in ``["learn/task=paper", "learn.rollout_s=3.0"]``.

        Without ``hold_s`` an action is held for ``learn.decision.longest_s``. Raises ConfigError for either where it
        is not allowed.
        """
        site = find_site()
        config = composed(site, list(overrides))
        self.settings: LearnSettings = resolve_files(
            build(LearnSettings, config["learn"], "learn"), "learn", site.data_roots
        )
        self._environment = SwingUpEnvironment(self.settings, build(GameSettings, config["game"], "game"))
        self._hold_s = self.settings.decision.longest_s if hold_s is None else hold_s
        if not self.settings.step_s <= self._hold_s <= self.settings.rollout_s:
            raise ConfigError(
                "hold_s",
                f"'hold_s' is {self._hold_s}; allowed: from learn.step_s, {self.settings.step_s}, to learn.rollout_s, "
                f"{self.settings.rollout_s}",
            )
        workspace = self.settings.workspace
        reach_m = 2.0 * workspace.half_width_m
        highest = np.array([reach_m, 2.0 * workspace.max_speed_m_s, math.pi, LARGEST_RATE_RAD_S])
        self.observation_space = spaces.Box(-highest, highest, dtype=np.float64)
        self.action_space = spaces.Discrete(len(self.settings.actions_m_s2))
        self._rolling: Rolling | None = None
        self._t_s = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Hang the ball, but for the noise of ``learn.noise``; the same ``seed`` begins the same rollouts."""
        super().reset(seed=seed)
        self._rolling = self._environment.rolling(self._environment.noise(self.np_random))
        reading, self._t_s = next(self._rolling)
        return self._observation(reading), {"success": False}

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold an action; raises gymnasium's ResetNeeded before ``reset`` and after the end."""
        if self._rolling is None:
            raise gymnasium.error.ResetNeeded("call reset() first: no rollout is under way")
        wanted = self.settings.actions_m_s2[int(action)]
        try:
            reading, self._t_s = self._rolling.send((wanted, self._t_s + self._hold_s - 1e-9))
        except StopIteration as end:
            return self._ended(end.value)
        reward = step_reward(self.settings.reward, reading.x_m)
        return self._observation(reading), reward, False, False, {"success": False}

    def _ended(self, rollout: SimulatedRollout) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        self._rolling = None
        rewards = self.settings.reward
        miss_m = None if rollout.catch is None else rollout.catch.miss_m
        reward = step_reward(rewards, rollout.final.x_m) + final_reward(rewards, rollout.outcome, miss_m)
        info = {
            "success": rollout.success,
            "outcome": rollout.outcome,
            "duration_s": rollout.duration_s,
            "half_swings": rollout.half_swings,
            "peak_displacement_m": rollout.peak_displacement_m,
        }
        late = rollout.outcome == "timeout"
        return self._observation(rollout.final), reward, not late, late, info

    def _observation(self, reading: SwingState) -> Observation:
        x_m, velocity_m_s, angle_rad, rate_rad_s = reading
        plain = np.array([x_m, velocity_m_s, math.remainder(angle_rad, 2.0 * math.pi), rate_rad_s])
        box = self.observation_space
        assert isinstance(box, spaces.Box)
        return plain.clip(box.low, box.high)


if NAME not in gymnasium.registry:
    gymnasium.register(NAME, entry_point="kendama_cli.gym:SwingUp")
