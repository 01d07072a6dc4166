"""Catch the flying ball, or play the whole game: ``kendama/Catch-v0`` and ``kendama/Game-v0``, on the rail.

Here the agent moves the cup until the ball is in it: no flight follows by itself. The ball is caught where it comes
down through the plane of the rim within the mouth (the rail's cup does not touch the ball).
"""

from __future__ import annotations

import abc
import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.learning.reward import Flight, Goal
from kendama_cli.learning.state import SwingState
from kendama_cli.motion.braking import BrakingLimiter
from kendama_cli.physics.free_fall import Landing
from kendama_cli.physics.rim_crossing import falls, falls_in
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.plugins.agents.environments.picture import PaintedEnv
from kendama_cli.plugins.agents.environments.rollout_options import RolloutOptions, option_dictionary
from kendama_cli.plugins.agents.environments.spaces import Accelerations, ActionKind, Observation, Observed
from kendama_cli.plugins.agents.environments.swing_up import task
from kendama_cli.simulation.swingup.engine import catch_limiter, mouth_m
from kendama_cli.simulation.swingup.rail import CompiledRail

MOST_DRAWS = 10_000
NEAR_M = 0.3
"""A miss is worth part of a catch up to here."""


class FreeCup(PaintedEnv[Observation]):
    """Base of Catch and GameEnv.

    Observation, float32 (7,): cup position x [m] and velocity [m/s], ball beside the tie point along x and z [m], its
    velocity relative to the cup along x and z [m/s], time left [s]. Action, held for ``hold_s``: which of
    ``learn.actions_m_s2``, or a fraction of the largest; the limits of ``learn.workspace`` hold whatever is asked.
    Reward 1 for a catch; at the first way down past the rim else max(0, 1 - miss / 0.3 m) / 2. Terminated by either,
    truncated when time is up. ``info``: is_success, and at a crossing miss_m.
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 50}  # noqa: RUF012 - gymnasium's own declaration
    longest_s = 1.0

    def __init__(
        self,
        overrides: Sequence[str] = (),
        hold_s: float = 0.02,
        *,
        actions: ActionKind = "continuous",
        normalised: bool = False,
        render_mode: str | None = None,
    ) -> None:
        """Compose ``overrides`` as on the command line; raises ConfigError for what is not allowed."""
        self.settings, self._game = task(overrides)
        super().__init__(self._game, self.settings.workspace.half_width_m, render_mode)
        step_s = self.settings.step_s
        if not step_s <= hold_s <= self.longest_s:
            raise ConfigError(
                "hold_s", f"'hold_s' is {hold_s}; allowed: from learn.step_s, {step_s}, to {self.longest_s}"
            )
        self._hold, self._at_most = round(hold_s / step_s), round(self.longest_s / step_s)
        self._rail, self._played = CompiledRail(self._game, step_s), self._game
        self._limiter: BrakingLimiter = catch_limiter(self.settings)
        workspace, rope_m = self.settings.workspace, self._game.rope.length_m
        reach, fast = np.array([2.0 * workspace.half_width_m, 2.0 * workspace.max_speed_m_s]), 20.0
        maximum = np.array([*reach, 2.0 * rope_m, 2.0 * rope_m, fast, fast, self.longest_s])
        scale = np.array([*(0.5 * reach), rope_m, rope_m, 0.2 * fast, 0.2 * fast, self.longest_s])
        self._observed = Observed(maximum, scale, normalised)
        self._accelerations = Accelerations(self.settings, actions)
        self.observation_space, self.action_space = self._observed.box, self._accelerations.space
        self._taken, self._over = 0, True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin anew; the same ``seed`` begins the same rollouts. The one option is SwingUp's ``cup``."""
        super().reset(seed=seed)
        if unknown := sorted({*option_dictionary(options)} - {"cup"}):
            raise ConfigError("options", f"options {unknown} are unknown; allowed: cup")
        self._painter.game = self._played = RolloutOptions.of(options).game(self._game)
        self._rail = CompiledRail(self._played, self.settings.step_s)
        self._rail.start(self._drawn(self.np_random))
        self._taken, self._over = 0, False
        self._show()
        return self._observation(), {"is_success": False}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold an action; raises gymnasium's ResetNeeded before ``reset`` and after the end, InvalidAction for none."""
        if self._over:
            raise gymnasium.error.ResetNeeded("call reset() first: no rollout is under way")
        desired, rail, rim_m = self._accelerations.one(action), self._rail, self._game.cup.rim_m
        for _ in range(self._hold):
            above = rail.above_m
            rail.step(self._limiter.limit(desired, *rail.reference))
            self._taken += 1
            if falls(above - rim_m, rail.above_m - rim_m):
                return self._down()
            if self._taken == self._at_most:
                self._over = True
                break
        self._show()
        return self._observation(), 0.0, False, self._over, {"is_success": False}

    @abc.abstractmethod
    def _drawn(self, rng: np.random.Generator) -> SwingState:
        """Return a state to begin in."""

    def _down(self) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        rail, workspace = self._rail, self.settings.workspace
        miss_m, edge_m = abs(rail.across_m), workspace.half_width_m if workspace.kind == "terminate" else math.inf
        over_m = rail.above_m - self._game.cup.rim_m
        limits = {"mouth_m": mouth_m(self._played), "edge_m": edge_m, "step_s": self.settings.step_s}
        caught = falls_in(rail.x_m, rail.across_m, over_m, rail.above_m_s, **limits)
        self._over = True
        self._show()
        reward = 1.0 if caught else 0.5 * max(0.0, 1.0 - miss_m / NEAR_M)
        return self._observation(), reward, True, False, {"is_success": caught, "miss_m": miss_m}

    def _observation(self) -> Observation:
        rail, left_s = self._rail, self.longest_s - self._taken * self.settings.step_s
        numbers = rail.x_m, rail.velocity_m_s, rail.across_m, rail.above_m, rail.across_m_s, rail.above_m_s, left_s
        return self._observed.of(np.array(numbers))

    def _places(self) -> tuple[float, float, float]:
        return self._rail.x_m, self._rail.across_m, self._rail.above_m


class Catch(FreeCup):
    """Catch a ball that has just been let go, on either side: the rope slack, the landing within the cup's reach.

    It begins in the window of ``learn.goal``, at random among the states from which a constant acceleration within
    ``learn.goal.catch_acceleration_m_s2`` meets the ball.
    """

    def _drawn(self, rng: np.random.Generator) -> SwingState:
        goal, workspace = self.settings.goal, self.settings.workspace
        flight = Flight.of(self._played)
        window, rope = Goal(goal, flight), TautRope.of(self._played)
        for _ in range(MOST_DRAWS):
            side, share_x, share_v = rng.choice([-1.0, 1.0]), *rng.uniform(-0.8, 0.8, 2)
            angle = math.radians(rng.uniform(goal.angle_deg - goal.tolerance_deg, goal.angle_deg + goal.tolerance_deg))
            rate = rng.uniform(goal.min_rate_rad_s, goal.max_rate_rad_s)
            state = SwingState(
                share_x * workspace.half_width_m, share_v * workspace.max_speed_m_s, side * angle, side * rate
            )
            slack = rope.tension_m_s2(angle, rate, 0.0, self._game.gravity_m_s2) <= 0.0
            landing = flight.landing(state)
            if slack and landing is not None and window.in_window(state) and self._within_reach(landing):
                return state
        angles = f"{goal.angle_deg:g} +- {goal.tolerance_deg:g} deg"
        rates = f"{goal.min_rate_rad_s:g} to {goal.max_rate_rad_s:g} rad/s"
        raise ConfigError(
            "learn.goal",
            f"of {MOST_DRAWS} states of its window ({angles}, {rates}) none lets a ball fall within the cup's reach "
            "with a slack rope; widen it, or take another learn/task",
        )

    def _within_reach(self, landing: Landing) -> bool:
        goal = self.settings.goal
        near = abs(landing.x_m) <= self.settings.workspace.half_width_m
        return near and abs(landing.acceleration_m_s2) <= goal.catch_acceleration_m_s2


class GameEnv(FreeCup):
    """The whole game by one agent: swing the ball up from hanging, let it go, catch it. Only the catch is rewarded."""

    longest_s = 5.0

    def _drawn(self, rng: np.random.Generator) -> SwingState:
        levels = self.settings.noise
        angle, position = rng.standard_normal(2)
        return SwingState(levels.start_position_m * position, 0.0, math.radians(levels.start_angle_deg) * angle, 0.0)
