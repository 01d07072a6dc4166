"""Many swing-ups at once in compiled code, on the rail: ``gymnasium.make_vec("kendama/SwingUp-v1", num_envs=1024)``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.learning.reward import final_reward, step_reward
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import RailEngine
from kendama_cli.plugins.agents.environments.many_rollouts import hold_each
from kendama_cli.plugins.agents.environments.rollout_options import RolloutOptions
from kendama_cli.plugins.agents.environments.spaces import Accelerations, ActionKind, Observation, Observed
from kendama_cli.plugins.agents.environments.swing_up import HOLD_S, Shaping, held, task
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.rail import CompiledRail, Rules


class RailRollouts:
    """``n`` rollouts; ``ends`` says how each ended (kernel.DUE: it goes on), ``misses_m`` by how much (NaN: caught)."""

    def __init__(self, n: int, hold_s: float, settings: LearnSettings, game: GameSettings) -> None:
        """Prepare n rollouts whose actions are held for ``hold_s``; raises ConfigError where a body's delay is
        longer.
        """
        self._n, self._settings, self._given, self._game = n, settings, game, game
        self._hold, self._at_most = round(hold_s / settings.step_s), max(1, round(settings.rollout_s / settings.step_s))
        rules = Rules.of(settings, game)
        self._rules = np.repeat(rules.packed()[0], n)
        self._catches = np.repeat(rules.packed_for_the_catch(), n)
        self._swings, self._tallies, self._before = np.zeros((n, 8)), np.zeros((n, kernel.TALLY)), np.zeros((n, 2))
        self._taken, self._delays = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.ends, self.misses_m = np.full(n, kernel.TIMEOUT), np.zeros(n)
        self._errors = np.zeros((3, n, -(-self._at_most // self._hold)))
        self._scales: list[tuple[float, ...]] = [(1.0, 1.0, 1.0)] * n
        self._rail, self._on = CompiledRail(game, settings.step_s), (1.0, 1.0)
        self._check_delay(settings.randomisation.delay_s)

    @property
    def durations_s(self) -> NDArray[np.float64]:
        """Return how long each has taken, without the flight [s]."""
        return np.asarray(self._taken * self._settings.step_s, dtype=np.float64)

    def hold(self, wanted_m_s2: NDArray[np.float64]) -> None:
        """Hold an acceleration (n,) in every rollout that goes on."""
        hold_each(
            self._swings,
            self._tallies,
            self._taken,
            self.ends,
            self.misses_m,
            wanted_m_s2,
            self._errors_now()[2],
            self._before,
            self._delays,
            self._rules,
            self._catches,
            self._hold,
            self._at_most,
        )

    def readings(self) -> NDArray[np.float64]:
        """Return cup position and velocity, ball angle and rate, time left (n, 5); noisy where a rollout goes on."""
        s = self._swings
        across, above, across_rate = s[:, 1] - s[:, 0], s[:, 2], s[:, 4] - s[:, 3]
        angle_error, rate_error, _ = np.where(self.ends == kernel.DUE, self._errors_now(), 0.0)
        angle = np.arctan2(across, -above) + angle_error
        rate = (-above * across_rate + across * s[:, 5]) / (across * across + above * above) + rate_error
        angle = np.mod(angle + math.pi, 2.0 * math.pi) - math.pi
        left_s = self._settings.rollout_s - self.durations_s
        return np.stack([s[:, 0], s[:, 3], angle, rate, left_s], axis=1)

    def begin(self, which: NDArray[np.int64], options: RolloutOptions, rngs: Sequence[Generator]) -> None:
        """Hang the balls of ``which``, each with what its own of the generators (n,) draws: that of SwingUp."""
        if options.body is not None:
            self._check_delay(options.body.get("delay_s", 0.0))
        if (game := options.game(self._given)) != self._game:  # the options of a reset are those of all
            self._game, self._scales, self._on = game, [()] * self._n, (1.0, 1.0)
            self._rail = CompiledRail(game, self._settings.step_s)
        self._before[which], self._tallies[which], self._taken[which] = (0.0, 1.0), 0.0, 0
        self.ends[which], self.misses_m[which] = kernel.DUE, math.nan
        for i in which.tolist():
            noise = options.drawn(self._settings, rngs[i])
            at_holds = slice(None, None, self._hold)
            gains = noise.gain[: self._errors.shape[2]]
            self._errors[:, i] = noise.angle_rad[at_holds], noise.rate_rad_s[at_holds], gains
            self._delays[i] = noise.delay_steps
            scales = noise.workspace_scale, noise.rope_scale, noise.drag_scale
            if scales != self._scales[i]:
                self._scales[i] = scales
                rules = Rules.of(self._settings.with_workspace_scale(scales[0]), self._game, *scales[1:])
                self._rules[i], self._catches[i] = rules.packed()[0][0], rules.packed_for_the_catch()[0]
            if scales[1:] != self._on:
                self._on = scales[1:]
                self._rail.take_on(*self._on)
            self._rail.start(SwingState(noise.start_position_m, 0.0, noise.start_angle_rad, 0.0))
            self._swings[i] = self._rail.numbers

    def _errors_now(self) -> NDArray[np.float64]:
        """Return the errors of angle and rate, and factors on the acceleration (3, n), of the holds that come next."""
        held = np.minimum(self._taken // self._hold, self._errors.shape[2] - 1)
        return np.asarray(self._errors[:, np.arange(self._n), held])

    def _check_delay(self, delay_s: float) -> None:
        if round(delay_s / self._settings.step_s) > self._hold:
            raise ConfigError(
                "delay_s",
                f"a delay of {delay_s} s is longer than an action is held, {self._hold * self._settings.step_s:g} s; "
                "hold actions longer, or take a single environment",
            )


Step = tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]
ANGLE, RATE = 2, 3


class SwingUpVector(VectorEnv[Observation, Any, Any]):
    """``num_envs`` environments of SwingUp, each with its own noise and body; the next step after an end resets it.

    With ``autoreset_mode`` SAME_STEP the step that ends a rollout begins the next, and ``info`` has final_obs and
    final_info, as in Gymnasium's own vectors.
    Spaces, rewards, ends and numbers are SwingUp's, also what a seed draws; only the engine ``rail`` is compiled.
    ``info`` has arrays ``is_success``, ``outcome`` and ``duration_s`` with the masks that Gymnasium gives them.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}  # noqa: RUF012 - gymnasium's own

    def __init__(
        self,
        num_envs: int = 1,
        overrides: Sequence[str] = (),
        hold_s: float = HOLD_S,
        *,
        actions: ActionKind = "discrete",
        normalised: bool = False,
        shaping: float = 0.0,
        gamma: float | None = None,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
    ) -> None:
        """Take SwingUp's arguments; ``max_episode_steps`` truncates as Gymnasium's TimeLimit does a single one.

        Raises ConfigError for what is not allowed, an engine that is not compiled included.
        """
        if isinstance(num_envs, bool) or not isinstance(num_envs, (int, np.integer)) or num_envs < 1:
            raise ConfigError("num_envs", f"'num_envs' is {num_envs!r}; allowed: a whole number, 1 or more")
        self.settings, game = task(overrides)
        if not isinstance(self.settings.engine, RailEngine):
            raise ConfigError("simulation/engine", "many environments at once run on the rail: simulation/engine=rail")
        if autoreset_mode not in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
            raise ConfigError(
                "autoreset_mode", f"'autoreset_mode' is {autoreset_mode!r}; allowed: AutoresetMode.NEXT_STEP, SAME_STEP"
            )
        self.metadata = {**self.metadata, "autoreset_mode": autoreset_mode}
        self.num_envs = num_envs
        self._observed = Observed.swing(self.settings, normalised=normalised)
        self._accelerations = Accelerations(self.settings, actions)
        self._shaping = Shaping(shaping, gamma, game)
        self.single_observation_space, self.single_action_space = self._observed.box, self._accelerations.space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._options, self._begun = RolloutOptions(), False
        self._rollouts = RailRollouts(num_envs, held(self.settings, hold_s), self.settings, game)
        self._potential = np.zeros(num_envs)
        self._rngs = [seeding.np_random()[0] for _ in range(num_envs)]
        self._steps, self._most_steps = np.zeros(num_envs, np.int64), max_episode_steps

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Hang every ball; ``options`` as SwingUp's, for all of them.

        As in Gymnasium's own vectors ``seed`` is a list of one for each, or a number to which each adds its index.
        An environment's seed alone decides its rollouts: those of SwingUp. Raises ConfigError for another length.
        """
        if isinstance(seed, list) and len(seed) != self.num_envs:
            raise ConfigError("seed", f"'seed' has {len(seed)} entries; allowed: {self.num_envs}, one for each")
        for i in range(self.num_envs):
            one = seed[i] if isinstance(seed, list) else None if seed is None else seed + i
            if one is not None:
                self._rngs[i], _ = seeding.np_random(one)
        self._options, self._begun = RolloutOptions.of(options), True
        self._rollouts.begin(np.arange(self.num_envs), self._options, self._rngs)
        self._steps[:] = 0
        seen = self._rollouts.readings()
        self._potential = self._shaping.potential(seen[:, ANGLE], seen[:, RATE])
        return self._observed.of(seen), self._info(np.zeros(self.num_envs, np.bool_))

    def step(self, actions: Any) -> Step:
        """Hold an action in each; one that ended in the step before is reset instead, and its action not looked at.

        With SAME_STEP one that ends is reset in the same step.
        """
        if not self._begun:
            raise gymnasium.error.ResetNeeded("call reset() first: no rollout is under way")
        desired = self._accelerations.many(actions, self.num_envs)
        if self.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP:
            self._rollouts.hold(desired)
            self._steps += 1
            return self._begun_again(self._step(np.zeros(self.num_envs, np.bool_)))
        anew = self._rollouts.ends != kernel.DUE
        self._rollouts.begin(np.flatnonzero(anew), self._options, self._rngs)
        self._rollouts.ends[anew] = kernel.TIMEOUT  # passed over
        self._rollouts.hold(desired)
        self._rollouts.ends[anew] = kernel.DUE
        self._steps = np.where(anew, 0, self._steps + 1)
        return self._step(anew)

    def _step(self, anew: NDArray[np.bool_]) -> Step:
        seen, ended = self._rollouts.readings(), self._rollouts.ends != kernel.DUE
        late = self._rollouts.ends == kernel.TIMEOUT
        potential = self._shaping.potential(seen[:, ANGLE], seen[:, RATE])
        terminated = ended & ~late
        following = np.where(terminated, 0.0, potential)
        rewards = self.settings.reward
        reward = step_reward(rewards, seen[:, 0]) + self._shaping.reward(self._potential, following)
        for i in np.flatnonzero(ended).tolist():
            outcome, miss_m = self._outcome(i)
            reward[i] += final_reward(rewards, outcome, miss_m)
        reward[anew] = 0.0
        self._potential = potential
        info = self._info(ended)
        if self._most_steps is not None:
            cut = ~anew & (self._steps >= self._most_steps)
            self._rollouts.ends[cut & ~ended] = kernel.TIMEOUT  # the next step hangs the ball anew
            late |= cut
        return self._observed.of(seen), reward, terminated, late, info

    def _begun_again(self, step: Step) -> Step:
        """Return ``step`` with the rollouts that ended in it begun anew."""
        seen, reward, terminated, late, ended_info = step
        over = terminated | late
        if not over.any():
            return step
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(over).tolist():
            final[i] = seen[i]
        self._rollouts.begin(np.flatnonzero(over), self._options, self._rngs)
        self._steps[over] = 0
        readings = self._rollouts.readings()
        self._potential = self._shaping.potential(readings[:, ANGLE], readings[:, RATE])
        told = {"final_obs": final, "_final_obs": over, "final_info": ended_info, "_final_info": over}
        return self._observed.of(readings), reward, terminated, late, {**self._info(np.zeros_like(over)), **told}

    def _outcome(self, i: int) -> tuple[Any, float | None]:
        if self._rollouts.ends[i] != kernel.GOAL:
            return ("timeout" if self._rollouts.ends[i] == kernel.TIMEOUT else "outside"), None
        caught = math.isnan(self._rollouts.misses_m[i])
        missed = self.settings.goal.success == "caught" and not caught
        return ("missed" if missed else "goal"), None if caught else float(self._rollouts.misses_m[i])

    def _info(self, ended: NDArray[np.bool_]) -> dict[str, Any]:
        outcomes = np.full(self.num_envs, "", dtype="<U7")
        for i in np.flatnonzero(ended).tolist():
            outcomes[i] = self._outcome(i)[0]
        return {
            "is_success": outcomes == "goal",
            "_is_success": np.ones(self.num_envs, np.bool_),
            "outcome": outcomes,
            "_outcome": ended,
            "duration_s": np.where(ended, self._rollouts.durations_s, 0.0),
            "_duration_s": ended,
        }
