"""Many swing-ups at once in compiled code, on the rail: ``gymnasium.make_vec("kendama/SwingUp-v1", num_envs=1024)``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.gym.rollout_options import RolloutOptions
from kendama_cli.gym.spaces import Accelerations, ActionKind, Observation, Observed
from kendama_cli.gym.swing_up import Shaping, held, task
from kendama_cli.learning.reward import final_reward
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import RailEngine
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.noise import FURTHEST_ERROR
from kendama_cli.simulation.swingup.rail import CompiledRail, Rules

Step = tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]
ANGLE, RATE = 2, 3


class SwingUpVector(VectorEnv[Observation, Any, Any]):
    """``num_envs`` environments of SwingUp, each with its own noise and body; the next step after an end resets it.

    Spaces, rewards and ends are SwingUp's, and without noise the numbers too; only the engine ``rail`` is compiled.
    ``info`` has arrays ``success``, ``outcome`` and ``duration_s`` with the masks that Gymnasium gives them.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}  # noqa: RUF012 - gymnasium's own

    def __init__(
        self,
        num_envs: int = 1,
        overrides: Sequence[str] = (),
        hold_s: float | None = None,
        *,
        actions: ActionKind = "discrete",
        normalised: bool = False,
        shaping: float = 0.0,
    ) -> None:
        """As SwingUp's; raises ConfigError for what is not allowed, an engine that is not compiled included."""
        if num_envs < 1:
            raise ConfigError("num_envs", f"'num_envs' is {num_envs}; allowed: 1 or more")
        self.settings, self._game = task(["simulation/engine=rail", *overrides])
        if not isinstance(self.settings.engine, RailEngine):
            raise ConfigError("simulation/engine", "many environments at once run on the rail: simulation/engine=rail")
        self.num_envs = num_envs
        self._hold = round(held(self.settings, hold_s) / self.settings.step_s)
        self._at_most = max(1, round(self.settings.rollout_s / self.settings.step_s))
        self._observed = Observed.swing(self.settings, normalised=normalised)
        self._accelerations = Accelerations(self.settings, actions)
        self._shaping = Shaping(shaping, self.settings, self._game)
        self.single_observation_space, self.single_action_space = self._observed.box, self._accelerations.space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._options = RolloutOptions()
        self._allocate(num_envs)

    def _allocate(self, n: int) -> None:
        rules = Rules.of(self.settings, self._game)
        self._rules = np.repeat(rules.packed()[0], n)
        self._catches = np.repeat(rules.packed_for_the_catch(), n)
        self._swings, self._tallies, self._before = np.zeros((n, 8)), np.zeros((n, kernel.TALLY)), np.zeros((n, 2))
        self._taken, self._delays = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self._ends, self._misses = np.full(n, kernel.TIMEOUT), np.zeros(n)
        self._noise, self._strength, self._offset = np.zeros(n), np.ones(n), np.zeros(n)
        self._potential = np.zeros(n)
        self._scales: list[tuple[float, float, float]] = [(1.0, 1.0, 1.0)] * n
        self._rail, self._on = CompiledRail(self._game, self.settings.step_s), (1.0, 1.0)
        self._delay_steps(self.settings.bodies.delay_s)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Hang every ball; ``options`` as SwingUp's, for all of them. One ``seed`` for all, or the first of a list."""
        super().reset(seed=seed[0] if isinstance(seed, list) else seed)
        self._options = RolloutOptions.of(options)
        self._begin(np.arange(self.num_envs))
        seen = self._readings()
        self._potential = self._shaping.potential(seen[:, ANGLE], seen[:, RATE])
        return self._observed.of(seen), self._info(np.zeros(self.num_envs, np.bool_))

    def step(self, actions: Any) -> Step:
        """Hold an action in each; one that ended in the step before is reset instead, and its action not looked at."""
        if not self._taken.any() and (self._ends == kernel.TIMEOUT).all():
            raise gymnasium.error.ResetNeeded("call reset() first: no rollout is under way")
        wanted = self._accelerations.many(actions, self.num_envs)
        anew = self._ends != kernel.DUE
        self._begin(np.flatnonzero(anew))
        errors = self.np_random.standard_normal(self.num_envs).clip(-FURTHEST_ERROR, FURTHEST_ERROR)
        gains = (1.0 + self._noise * self.settings.noise.acceleration * errors) * self._strength
        self._ends[anew] = kernel.TIMEOUT  # passed over
        kernel.hold_each(
            self._swings,
            self._tallies,
            self._taken,
            self._ends,
            self._misses,
            wanted,
            gains,
            self._before,
            self._delays,
            self._rules,
            self._catches,
            self._hold,
            self._at_most,
        )
        self._ends[anew] = kernel.DUE
        return self._step(anew)

    def _step(self, anew: NDArray[np.bool_]) -> Step:
        seen, ended = self._readings(), self._ends != kernel.DUE
        late = self._ends == kernel.TIMEOUT
        potential = self._shaping.potential(seen[:, ANGLE], seen[:, RATE])
        following = np.where(ended & ~late, 0.0, potential)
        rewards = self.settings.reward
        beyond = np.maximum(0.0, np.abs(seen[:, 0]) - rewards.displacement_free_m)
        reward = rewards.step - rewards.displacement_per_m * beyond + self._shaping.reward(self._potential, following)
        for i in np.flatnonzero(ended).tolist():
            outcome, miss_m = self._outcome(i)
            reward[i] += final_reward(rewards, outcome, miss_m)
        reward[anew] = 0.0
        self._potential = potential
        return self._observed.of(seen), reward, ended & ~late, late, self._info(ended)

    def _outcome(self, i: int) -> tuple[Any, float | None]:
        if self._ends[i] != kernel.GOAL:
            return ("timeout" if self._ends[i] == kernel.TIMEOUT else "outside"), None
        caught = math.isnan(self._misses[i])
        missed = self.settings.goal.success == "caught" and not caught
        return ("missed" if missed else "goal"), None if caught else float(self._misses[i])

    def _info(self, ended: NDArray[np.bool_]) -> dict[str, Any]:
        outcomes = np.full(self.num_envs, "", dtype="<U7")
        for i in np.flatnonzero(ended).tolist():
            outcomes[i] = self._outcome(i)[0]
        return {
            "success": outcomes == "goal",
            "_success": np.ones(self.num_envs, np.bool_),
            "outcome": outcomes,
            "_outcome": ended,
            "duration_s": np.where(ended, self._taken * self.settings.step_s, 0.0),
            "_duration_s": ended,
        }

    def _readings(self) -> NDArray[np.float64]:
        s, levels = self._swings, self.settings.noise
        across, above, across_rate = s[:, 1] - s[:, 0], s[:, 2], s[:, 4] - s[:, 3]
        errors = self._noise[:, None] * self.np_random.standard_normal((self.num_envs, 2))
        going = self._ends == kernel.DUE
        angle = np.arctan2(across, -above)
        angle += np.where(going, math.radians(levels.angle_reading_deg) * errors[:, 0] + self._offset, 0.0)
        rate = (-above * across_rate + across * s[:, 5]) / (across * across + above * above)
        rate += np.where(going, levels.rate_reading_rad_s * errors[:, 1], 0.0)
        angle = np.mod(angle + math.pi, 2.0 * math.pi) - math.pi
        left_s = self.settings.rollout_s - self._taken * self.settings.step_s
        return np.stack([s[:, 0], s[:, 3], angle, rate, left_s], axis=1)

    def _begin(self, which: NDArray[np.int64]) -> None:
        """Hang the balls of ``which``, each with a noise and on a body of its own."""
        m, rng, levels = len(which), self.np_random, self.settings.noise
        starts = rng.standard_normal((m, 2))
        self._noise[which] = self._options.noise * rng.uniform(*self.settings.bodies.noise, m)
        bodies = self._bodies(m)
        self._strength[which] = [body.strength for body in bodies]
        self._offset[which] = [body.offset_rad for body in bodies]
        self._delays[which] = [body.delay_steps for body in bodies]
        self._before[which], self._tallies[which], self._taken[which] = (0.0, 1.0), 0.0, 0
        self._ends[which], self._misses[which] = kernel.DUE, math.nan
        angles = self._noise[which] * math.radians(levels.start_angle_deg) * starts[:, 0]
        places = self._noise[which] * levels.start_position_m * starts[:, 1]
        for i, body, angle, place in zip(which.tolist(), bodies, angles.tolist(), places.tolist(), strict=True):
            if body.scales != self._scales[i]:
                self._scales[i] = body.scales
                rules = Rules.of(self.settings.with_workspace_scale(body.workspace), self._game, body.rope, body.drag)
                self._rules[i], self._catches[i] = rules.packed()[0][0], rules.packed_for_the_catch()[0]
            if body.scales[1:] != self._on:
                self._on = body.scales[1:]
                self._rail.take_on(*self._on)
            self._rail.start(SwingState(place, 0.0, angle, 0.0))
            self._swings[i] = self._rail.numbers

    def _bodies(self, m: int) -> list[_Body]:
        """Draw ``m`` bodies, or take the one that was asked for."""
        drawn, asked, step_s = self.settings.bodies, self._options.body, self.settings.step_s
        if asked is not None:
            delay_steps = self._delay_steps(asked.get("delay_s", 0.0))
            offset = math.radians(asked.get("angle_deg", 0.0))
            scales = 1.0, asked.get("rope", 1.0), asked.get("drag", 1.0)
            return [_Body(*scales, asked.get("acceleration", 1.0), offset, delay_steps)] * m
        strengths, offsets, longer = self.np_random.uniform(-1.0, 1.0, (3, m))
        narrower, later = self.np_random.uniform(0.0, 1.0, (2, m))
        return [
            _Body(workspace, rope, drag, strength, offset_rad, round(drawn.delay_s * share / step_s))
            for workspace, rope, drag, strength, offset_rad, share in zip(
                (1.0 - drawn.narrowing * narrower).tolist(),
                (1.0 + drawn.rope * longer).tolist(),
                self.np_random.uniform(*drawn.drag, m).tolist(),
                (1.0 + drawn.acceleration * strengths).tolist(),
                (math.radians(drawn.angle_deg) * offsets).tolist(),
                later.tolist(),
                strict=True,
            )
        ]

    def _delay_steps(self, delay_s: float) -> int:
        steps = round(delay_s / self.settings.step_s)
        if steps > self._hold:
            raise ConfigError(
                "delay_s",
                f"a delay of {delay_s} s is longer than an action is held, {self._hold * self.settings.step_s:g} s; "
                "hold actions longer, or take a single environment",
            )
        return steps


class _Body(NamedTuple):
    """What one rollout's body is: factors on workspace, rope, drag and acceleration; reading error; delay."""

    workspace: float
    rope: float
    drag: float
    strength: float
    offset_rad: float
    delay_steps: int

    @property
    def scales(self) -> tuple[float, float, float]:
        """What its rules are made of."""
        return self.workspace, self.rope, self.drag
