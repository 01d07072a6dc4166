"""The swing-up for agents that are given a goal: ``kendama/SwingUpGoal-v1``, after Gymnasium-Robotics' GoalEnv."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.agents.environments.picture import PaintedEnv
from kendama_cli.plugins.agents.environments.rollout_options import RolloutOptions, RolloutUnderWay, option_dictionary
from kendama_cli.plugins.agents.environments.spaces import (
    LARGEST_RATE_RAD_S,
    Accelerations,
    ActionKind,
    Observation,
    Observed,
)
from kendama_cli.plugins.agents.environments.swing_up import HOLD_S, held, task

GoalObservation = dict[str, Observation]


class GoalReward(gymnasium.Wrapper[GoalObservation, Any, GoalObservation, Any], gymnasium.utils.RecordConstructorArgs):
    """Wrapper that ``gymnasium.make`` adds: ``compute_reward`` through Gymnasium's wrappers, which hide a method of
    ours.
    """

    def __init__(self, env: gymnasium.Env[GoalObservation, Any]) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(self)
        super().__init__(env)

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """See SwingUpGoal."""
        return self.get_wrapper_attr("unwrapped").compute_reward(achieved_goal, desired_goal, info)


ROUNDING = 1e-5
"""Slack in comparing with the tolerance, for goals are float32."""
HIGHEST = math.pi, LARGEST_RATE_RAD_S


class SwingUpGoal(PaintedEnv[GoalObservation]):
    """Bring the ball to an angle with an angular velocity away from hanging: where it is to be let go.

    Observation: ``observation`` as that of SwingUp, with its reading noise; ``achieved_goal`` and ``desired_goal``,
    both float32 (2,): the ball's angle from hanging, on whichever side it is, 0 to pi [rad], and its angular velocity
    away from hanging [rad/s]. What is achieved is the true state. Another goal is drawn in every reset, evenly from
    ``angles_deg`` and ``rates_rad_s``, or taken from ``reset(options={"goal": (angle_rad, rate_rad_s)})``.

    Reward: ``compute_reward`` of both, sparse: 0 where they differ by no more than the tolerances and -1 elsewhere;
    dense: minus their distance, angles in pi and rates in 10 rad/s. Terminated as soon as the goal is reached, also
    in the midst of a held action; truncated after ``learn.rollout_s``, or where leaving the workspace ends a rollout.
    ``info["is_success"]`` says whether it was reached.
    """

    def __init__(
        self,
        overrides: Sequence[str] = (),
        hold_s: float = HOLD_S,
        *,
        actions: ActionKind = "continuous",
        normalised: bool = False,
        reward: Literal["sparse", "dense"] = "sparse",
        angles_deg: tuple[float, float] = (30.0, 90.0),
        rates_rad_s: tuple[float, float] = (1.0, 5.0),
        tolerance: tuple[float, float] = (0.1, 0.5),
        render_mode: str | None = None,
    ) -> None:
        """Set the ``tolerance`` of the angle [rad] and of the rate [rad/s]; for the rest see SwingUp.

        Raises ConfigError for what is not allowed.
        """
        if reward not in ("sparse", "dense"):
            raise ConfigError("reward", f"'reward' is {reward!r}; allowed: sparse, dense")
        _check_range("angles_deg", angles_deg, 180.0)
        _check_range("rates_rad_s", rates_rad_s, LARGEST_RATE_RAD_S)
        if not _two_numbers(tolerance) or not min(tolerance) > 0.0:
            raise ConfigError("tolerance", f"'tolerance' is {tolerance}; allowed: two numbers above 0")
        self.settings, self._game = task(overrides)
        super().__init__(self._game, self.settings.workspace.half_width_m, render_mode)
        self._rollout = RolloutUnderWay(self.settings, self._game)
        self._hold_s = held(self.settings, hold_s)
        self._observed = Observed.swing(self.settings, normalised=normalised)
        self._accelerations = Accelerations(self.settings, actions)
        self._sparse, self._tolerance = reward == "sparse", np.array(tolerance)
        self._goals = np.array([np.radians(angles_deg), rates_rad_s]).T
        goal: Any = spaces.Box(
            np.array([0.0, -HIGHEST[1]], np.float32), np.array(HIGHEST, np.float32), dtype=np.float32
        )
        self.observation_space: Any = spaces.Dict(
            {"observation": self._observed.box, "achieved_goal": goal, "desired_goal": goal}
        )
        self.action_space = self._accelerations.space
        self._goal = np.zeros(2, np.float32)
        self._reading = self._true = SwingState(0.0, 0.0, 0.0, 0.0)
        self._t_s = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[GoalObservation, dict[str, Any]]:
        """Hang the ball and draw a goal; ``options`` are ``goal`` and those of SwingUp."""
        super().reset(seed=seed)
        asked = option_dictionary(options).get("goal")
        sampled = self.np_random.uniform(*self._goals)
        self._goal = np.asarray(sampled if asked is None else _checked_goal(asked), dtype=np.float32)
        chosen = RolloutOptions.of(options, "goal")
        self._painter.game = chosen.game(self._game)
        noise = chosen.drawn(self.settings, self.np_random)
        self._reading, self._t_s = self._rollout.begin(noise, self._painter.game, self._window())
        self._true = self._rollout.state()
        self._show()
        return self._observation(), {"is_success": False}

    def step(self, action: Any) -> tuple[GoalObservation, float, bool, bool, dict[str, Any]]:
        """Hold an action; raises gymnasium's ResetNeeded before ``reset`` and after the end, InvalidAction for none."""
        if not self._rollout.waits:
            raise gymnasium.error.ResetNeeded("call reset() first: no rollout is under way")
        desired, outcome = self._accelerations.one(action), ""
        try:
            self._reading, self._t_s = self._rollout.answer(desired, self._t_s + self._hold_s - 1e-9)
            self._true = self._rollout.state()
        except StopIteration as end:
            outcome = end.value.outcome
            self._reading, self._true, self._t_s = end.value.final, end.value.final, end.value.duration_s
        self._show()
        observation, reached = self._observation(), outcome == "goal"
        info = {"is_success": reached, **({"outcome": outcome} if outcome else {})}
        reward = self.compute_reward(observation["achieved_goal"], observation["desired_goal"], info)
        return observation, float(reward), reached, bool(outcome) and not reached, info

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Return the reward for goals (..., 2), by nothing but the two: (...). ``info`` plays no part."""
        apart = np.abs(np.asarray(achieved_goal, np.float64) - np.asarray(desired_goal, np.float64))
        if self._sparse:
            reached = (apart <= self._tolerance + ROUNDING).all(axis=-1)
            return np.where(reached, 0.0, -1.0)
        return -np.hypot(apart[..., 0] / math.pi, apart[..., 1] / 10.0)

    def _window(self) -> Any:
        """Return the goal as that of a rollout."""
        (angle_rad, rate_rad_s), (wide_rad, fast_rad_s) = self._goal.tolist(), self._tolerance.tolist()
        return dataclasses.replace(
            self.settings.goal,
            success="reached",
            angle_deg=math.degrees(angle_rad),
            tolerance_deg=math.degrees(wide_rad),
            min_rate_rad_s=rate_rad_s - fast_rad_s,
            max_rate_rad_s=rate_rad_s + fast_rad_s,
        )

    def _observation(self) -> GoalObservation:
        achieved = np.array(
            [abs(self._true.angle_rad), math.copysign(1.0, self._true.angle_rad) * self._true.rate_rad_s]
        )
        limited = np.clip(achieved, [0.0, -HIGHEST[1]], HIGHEST).astype(np.float32)
        return {
            "observation": self._observed.reading(self._reading, self.settings.rollout_s - self._t_s),
            "achieved_goal": limited,
            "desired_goal": self._goal.copy(),
        }

    def _places(self) -> tuple[float, float, float]:
        return self._rollout.places()


def _check_range(name: str, given: tuple[float, float], highest: float) -> None:
    if not (_two_numbers(given) and 0.0 < given[0] <= given[1] <= highest):
        raise ConfigError(name, f"'{name}' is {given}; allowed: (low, high) with 0 < low <= high <= {highest:g}")


def _two_numbers(given: Any) -> bool:
    try:
        return np.asarray(given, dtype=np.float64).shape == (2,)
    except (TypeError, ValueError):
        return False


def _checked_goal(given: Any) -> NDArray[np.float64]:
    if not _two_numbers(given) or not (0.0 < given[0] <= HIGHEST[0] and abs(given[1]) <= HIGHEST[1]):
        raise ConfigError(
            "goal", f"option 'goal' is {given!r}; allowed: angle above 0 to pi [rad], rate -100 to 100 [rad/s]"
        )
    return np.asarray(given, dtype=np.float64)
