"""The swing-up as a Gymnasium environment, in any engine: ``kendama/SwingUp-v1``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.errors import ConfigError
from kendama_cli.learning.reward import final_reward, step_reward
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.plugins.agents.environments.picture import PaintedEnv
from kendama_cli.plugins.agents.environments.rollout_options import RolloutOptions, RolloutUnderWay
from kendama_cli.plugins.agents.environments.spaces import Accelerations, ActionKind, Observation, Observed
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.rollout import SimulatedRollout

HOLD_S = 0.05
"""Period of an agent's decisions at which the product's own learner succeeds on every seed (howto/gymnasium.md)."""


def task(overrides: Sequence[str]) -> tuple[LearnSettings, GameSettings]:
    """Return task and game with ``overrides`` as on the command line, on the rail unless they name another engine.

    Raises ConfigError where one is not allowed.
    """
    if isinstance(overrides, str):
        raise ConfigError("overrides", f"'overrides' is {overrides!r}; allowed: a list, [{overrides!r}]")
    site = find_site()
    config = composed(site, ["simulation/engine=rail", *overrides])
    learn = resolve_files(build(LearnSettings, config["learn"], "learn"), "learn", site.data_roots)
    return learn, build(GameSettings, config["game"], "game")


def held(settings: LearnSettings, hold_s: float) -> float:
    """Return how long an action is held [s], in whole time steps.

    Raises ConfigError where that is shorter than a step or longer than a rollout.
    """
    if not settings.step_s <= hold_s <= settings.rollout_s:
        raise ConfigError(
            "hold_s",
            f"'hold_s' is {hold_s}; allowed: from learn.step_s, {settings.step_s}, to learn.rollout_s, "
            f"{settings.rollout_s}",
        )
    return round(hold_s / settings.step_s) * settings.step_s


class Shaping:
    """A reward of the ball's energy that leaves the best policy what it is (Ng, Harada and Russell, ICML 1999).

    gamma P(s') - P(s) with the potential P = weight min(1, (1 - cos phi + l phi'^2 / 2 g) / 2), which counts as 0 at a
    true end. So a rollout that ends is worth -P(s_0) more, whatever was done: for an agent with this very ``gamma``.
    """

    def __init__(self, weight: float, gamma: float | None, game: GameSettings) -> None:
        """Raise ConfigError for a ``weight`` that is no finite number, and for one without the agent's ``gamma``."""
        if not isinstance(weight, (int, float)) or not math.isfinite(weight):
            raise ConfigError("shaping", f"'shaping' is {weight!r}; allowed: a finite number, 0 for none")
        if gamma is None and weight == 0.0:
            gamma = 1.0
        if not isinstance(gamma, (int, float)) or not 0.0 <= gamma <= 1.0:
            raise ConfigError(
                "gamma",
                f"'gamma' is {gamma!r}; allowed: 0 to 1, your agent's discount, which 'shaping' needs",
            )
        self._weight, self._gamma = weight, gamma
        self._swing_s2 = 0.5 * game.rope.length_m / game.gravity_m_s2

    def potential(self, angle_rad: Any, rate_rad_s: Any) -> Any:
        """Return the potential P, of numbers or of arrays."""
        return self._weight * np.minimum(1.0, 0.5 * (1.0 - np.cos(angle_rad) + self._swing_s2 * rate_rad_s**2))

    def reward(self, before: Any, after: Any) -> Any:
        """Return what is added for a step between two potentials."""
        return self._gamma * after - before


class SwingUp(PaintedEnv[Observation]):
    """Swing the ball up from hanging and let it go, by the cup's acceleration along x.

    Observation, float32 (5,): cup position x [m] and velocity [m/s], ball angle about the tie point [rad] (0 hanging,
    positive toward +x, within +-pi) and angular velocity [rad/s], time left [s]; the ball's two with the reading noise
    of ``learn.noise``. Action, held for ``hold_s``: which of ``learn.actions_m_s2``, or a fraction of the largest.
    Reward: ``learn.reward``, the step's and at the end the final one, and ``shaping`` times the growth of the ball's
    energy for an agent with discount ``gamma``. Terminated at the release (flight and catch follow within that step),
    or outside where that ends a rollout; truncated after ``learn.rollout_s``. ``info`` has is_success, and at the end
    outcome, duration_s, half_swings and peak_displacement_m. For ``reset(options=...)`` see RolloutOptions.
    """

    def __init__(
        self,
        overrides: Sequence[str] = (),
        hold_s: float = HOLD_S,
        *,
        actions: ActionKind = "discrete",
        normalised: bool = False,
        shaping: float = 0.0,
        gamma: float | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Compose ``overrides`` as on the command line: ``["learn/task=paper_caught", "learn.rollout_s=3.0"]``.

        Raises ConfigError for what is not allowed.
        """
        self.settings, self._game = task(overrides)
        super().__init__(self._game, self.settings.workspace.half_width_m, render_mode)
        self._rollout = RolloutUnderWay(self.settings, self._game)
        self._hold_s = held(self.settings, hold_s)
        self._observed = Observed.swing(self.settings, normalised=normalised)
        self._accelerations = Accelerations(self.settings, actions)
        self._shaping = Shaping(shaping, gamma, self._game)
        self.observation_space = self._observed.box
        self.action_space = self._accelerations.space
        self._reading, self._t_s = SwingState(0.0, 0.0, 0.0, 0.0), 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Hang the ball, but for the noise of ``learn.noise``; the same ``seed`` begins the same rollouts."""
        super().reset(seed=seed)
        chosen = RolloutOptions.of(options)
        self._painter.game = chosen.game(self._game)
        sampled = chosen.drawn(self.settings, self.np_random)
        self._reading, self._t_s = self._rollout.begin(sampled, self._painter.game)
        self._show()
        return self._observation(), {"is_success": False}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold an action; raises gymnasium's ResetNeeded before ``reset`` and after the end, InvalidAction for none."""
        if not self._rollout.waits:
            raise gymnasium.error.ResetNeeded("call reset() first: no rollout is under way")
        desired, before = self._accelerations.one(action), self._potential()
        try:
            self._reading, self._t_s = self._rollout.answer(desired, self._t_s + self._hold_s - 1e-9)
        except StopIteration as end:
            return self._ended(end.value, before)
        self._show()
        reward = step_reward(self.settings.reward, self._reading.x_m)
        reward += float(self._shaping.reward(before, self._potential()))
        return self._observation(), reward, False, False, {"is_success": False}

    def _ended(self, rollout: SimulatedRollout, before: float) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        self._reading, self._t_s = rollout.final, rollout.duration_s
        self._show()
        rewards = self.settings.reward
        miss_m = None if rollout.catch is None else rollout.catch.miss_m
        reward = step_reward(rewards, rollout.final.x_m) + final_reward(rewards, rollout.outcome, miss_m)
        late = rollout.outcome == "timeout"
        reward += float(self._shaping.reward(before, self._potential() if late else 0.0))
        info = {
            "is_success": rollout.success,
            "outcome": rollout.outcome,
            "duration_s": rollout.duration_s,
            "half_swings": rollout.half_swings,
            "peak_displacement_m": rollout.peak_displacement_m,
        }
        return self._observation(), reward, not late, late, info

    def _potential(self) -> float:
        return float(self._shaping.potential(self._reading.angle_rad, self._reading.rate_rad_s))

    def _observation(self) -> Observation:
        return self._observed.reading(self._reading, self.settings.rollout_s - self._t_s)

    def _places(self) -> tuple[float, float, float]:
        return self._rollout.places()
