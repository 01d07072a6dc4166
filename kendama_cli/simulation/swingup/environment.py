"""The learning environment of the swing-up: rollouts of anything that acts, with noise and a bounded workspace."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Generator
from typing import cast

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.learning.interface import Actor
from kendama_cli.learning.reward import Flight, Goal, Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState, swing_direction
from kendama_cli.learning.task_settings import DartEngine, GoalSettings
from kendama_cli.physics.taut_rope import rope_angle
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.engine import StepCallback, SwingEngine, rate, state_of
from kendama_cli.simulation.swingup.flight import Release, fly
from kendama_cli.simulation.swingup.rail import CompiledRollouts
from kendama_cli.simulation.swingup.rollout import RolloutNoise, SimulatedRollout, draw_noise, no_noise
from kendama_cli.simulation.swingup.workspace import limiter

Rolling = Generator[tuple[SwingState, float], tuple[float, float], SimulatedRollout]
"""A rollout under way, see SwingUpEnvironment.rolling."""


class SwingUpEnvironment:
    """Cup, ball and rope in the engine that the settings name; rollouts start hanging at rest, but for the noise.

    Each step: a reading (noisy angle and rate; the cup's own state is known), the actor's acceleration, the
    workspace's limiter, the acceleration's error, the dynamics. The simulator judges the goal by the true state.
    ``settings`` and ``game`` are those it was made with.
    """

    def __init__(self, settings: LearnSettings, game: GameSettings, swing: SwingEngine | None = None) -> None:
        """Use ``swing`` in the place of the engine that ``settings.engine`` names.

        Raises ConfigError where the time step is too long for the rope.
        """
        longest_s = math.sqrt(game.ball.mass_kg / game.rope.stiffness_n_m)
        if settings.step_s > longest_s:  # beyond it even the damped rope gives the ball more energy than it took
            raise ConfigError(
                "learn.step_s",
                f"'learn.step_s' is {settings.step_s}; allowed: at most {longest_s:.6f} s for a rope of "
                f"{game.rope.stiffness_n_m:g} N/m and a ball of {game.ball.mass_kg:g} kg",
            )
        self.settings, self.game = settings, game
        self._step_s = settings.step_s
        self.n_steps = max(1, round(settings.rollout_s / settings.step_s))
        self._swing, self._compiled = (swing, None) if swing is not None else _opened(settings, game)

    def aimed(self, goal: GoalSettings) -> SwingUpEnvironment:
        """Return an environment with the same engine for another goal, not compiled."""
        return SwingUpEnvironment(dataclasses.replace(self.settings, goal=goal), self.game, self._swing)

    @property
    def compiled(self) -> bool:
        """Return True if rollouts run in compiled code, a thousand a second."""
        return self._compiled is not None

    def noise(self, rng: np.random.Generator, *, validation: bool = False) -> RolloutNoise:
        """Draw one rollout's noise, of a body of ``learn.randomisation`` or, where it is one, of a ``validation``."""
        settings = self.settings
        noise = draw_noise(settings, settings.validation.randomisation if validation else settings.randomisation, rng)
        if self._compiled is not None:  # compiled code reads arrays, a loop in Python lists, sooner
            return noise
        lists = {name: np.asarray(getattr(noise, name)).tolist() for name in ("angle_rad", "rate_rad_s", "gain")}
        return dataclasses.replace(noise, **lists)

    def noiseless(self) -> RolloutNoise:
        """Return the noise of the nominal rollout: none."""
        return no_noise(self.settings)

    def roll_out(self, actor: Actor, noise: RolloutNoise, on_step: StepCallback | None = None) -> SimulatedRollout:
        """Let ``actor`` swing until the release, the end of time or, where that ends it, the edge of the workspace.

        After a release (or the goal) the cup goes to meet the ball. ``on_step`` is called after every time step.
        """
        if self._compiled is not None and on_step is None and actor.decides_on_bins:
            return self._compiled.roll_out(actor, noise)
        rolling = self.rolling(noise, on_step)
        reading, t_s = next(rolling)
        while True:
            answer = (actor.act(reading, t_s), actor.next_look_s)
            try:
                reading, t_s = rolling.send(answer)
            except StopIteration as end:
                return cast(SimulatedRollout, end.value)

    def rolling(self, noise: RolloutNoise, on_step: StepCallback | None = None) -> Rolling:
        """Play a rollout from inside out: yield each reading and its time, and be sent the answer.

        The answer is the desired acceleration and the time before which no further reading is needed.
        """
        settings = self.settings.with_workspace_scale(noise.workspace_scale)
        swing, step_s = self._swing, self._step_s
        limit, goal = limiter(settings).limit, Goal(settings.goal, Flight.of(self.game, noise.rope_scale))
        release = Release(settings, goal)
        edge = settings.workspace.half_width_m
        ends_outside = settings.workspace.kind == "terminate"
        swing.take_on(noise.rope_scale, noise.drag_scale)
        swing.start(SwingState(noise.start_position_m, 0.0, noise.start_angle_rad, 0.0))
        outcome: Outcome = "timeout"
        look_s, peak_m, decisions = -math.inf, 0.0, 0
        given = (0.0, 1.0)
        coming = deque([given] * noise.delay_steps)
        half_swings, towards, k = 0, 0, 0
        for k in range(self.n_steps):
            t_s = k * step_s
            if t_s >= look_s:
                angle = rope_angle(swing.across_m, swing.above_m) + noise.angle_rad[k]
                reading = SwingState(swing.x_m, swing.velocity_m_s, angle, rate(swing) + noise.rate_rad_s[k])
                desired, next_look_s = yield reading, t_s
                gain = given[1]
                if next_look_s != look_s:
                    look_s, gain, decisions = next_look_s, noise.gain[decisions], decisions + 1
                given = (desired, gain)
            coming.append(given)
            acceleration, gain = coming.popleft()
            sent = limit(acceleration, *swing.reference) * gain
            swing.step(sent)
            if on_step is not None:
                on_step(t_s + step_s, swing, sent)
            x_m = abs(swing.x_m)
            if x_m > peak_m:
                peak_m = x_m
                if ends_outside and x_m > edge:
                    outcome = "outside"
                    break
            turning = rate(swing)
            now = swing_direction(turning, towards)
            if now != towards:
                towards = now
                half_swings += 1
            if release.after(swing):
                outcome = "goal"
                break
        duration_s, final, catch = (k + 1) * step_s, state_of(swing), None
        swing.check_finite(duration_s)
        if outcome == "goal":
            catch = fly(swing, settings, self.game, duration_s, on_step)
            if settings.goal.success == "caught" and not catch.caught:
                outcome = "missed"
        return SimulatedRollout(outcome, duration_s, peak_m, half_swings, final, catch)

    def state(self) -> SwingState:
        """Return the true plain state now."""
        return state_of(self._swing)

    def places(self) -> tuple[float, float, float]:
        """Return the present x of the cup, and the ball's x and z from its tie point [m]."""
        return self._swing.x_m, self._swing.across_m, self._swing.above_m


def _opened(settings: LearnSettings, game: GameSettings) -> tuple[SwingEngine, CompiledRollouts | None]:
    """Open the engine of ``settings.engine`` and its compiled rollouts, if it has them."""
    if isinstance(settings.engine, DartEngine):
        from kendama_cli.simulation.swingup.arm import ArmSwing  # noqa: PLC0415 - sweeps on the rail load no DART

        return ArmSwing(settings.engine.robot, settings, game), None
    compiled = CompiledRollouts(settings, game)
    return compiled.swing, compiled
