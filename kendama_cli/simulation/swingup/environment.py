"""The learning environment of the swing-up: rollouts of anything that acts, with noise and a bounded workspace."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import cast

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.learning.half_swings import swing_direction
from kendama_cli.learning.interface import Actor
from kendama_cli.learning.reward import Flight, Goal, Landing, Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import DartEngine
from kendama_cli.physics.taut_rope import Ball
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.compiled_rollouts import CompiledRollouts
from kendama_cli.simulation.swingup.engine import SwingEngine, rate
from kendama_cli.simulation.swingup.rollout import Catch, RolloutNoise, SimulatedRollout
from kendama_cli.simulation.swingup.workspace import limiter

FURTHEST_ERROR = 3.0
"""Errors of the acceleration are cut at this many standard deviations: no actuator's error is unbounded."""

StepCallback = Callable[[float, SwingEngine, float], None]
"""Called with the time, the engine and the cup's acceleration after every time step."""
Rolling = Generator[tuple[SwingState, float], tuple[float, float], SimulatedRollout]
"""A rollout under way, see SwingUpEnvironment.rolling."""


class SwingUpEnvironment:
    """Cup, ball and rope in the engine that the settings name; rollouts start hanging at rest, but for the noise.

    Each step: a reading (noisy angle and rate; the cup's own state is known), the actor's acceleration, the
    workspace's limiter, the acceleration's error, the dynamics. The simulator judges the goal by the true state.
    """

    def __init__(self, settings: LearnSettings, game: GameSettings, swing: SwingEngine | None = None) -> None:
        """``swing`` takes the place of the engine that ``settings.engine`` names.

        Raises ConfigError where the time step is too long for the rope.
        """
        longest_s = math.sqrt(game.ball.mass_kg / game.rope.stiffness_n_m)
        if settings.step_s > longest_s:  # beyond it even the damped rope gives the ball more energy than it took
            raise ConfigError(
                "learn.step_s",
                f"'learn.step_s' is {settings.step_s}; allowed: at most {longest_s:.6f} s for a rope of "
                f"{game.rope.stiffness_n_m:g} N/m and a ball of {game.ball.mass_kg:g} kg",
            )
        self._settings = settings
        self._step_s = settings.step_s
        self.n_steps = max(1, round(settings.rollout_s / settings.step_s))
        self.flight = Flight.of(game)
        self._limiter = limiter(settings)
        self._swing, self._compiled = (swing, None) if swing is not None else _opened(settings, game)

    def noise(self, rng: np.random.Generator, *, validation: bool = False) -> RolloutNoise:
        """Draw one rollout's noise at the levels of ``learn.noise``; a ``validation`` varies the body as well."""
        levels, n = self._settings.noise, self.n_steps
        start = rng.standard_normal(2).tolist()
        readings = rng.standard_normal((2, n))
        errors = rng.standard_normal(n).clip(-FURTHEST_ERROR, FURTHEST_ERROR)
        angle_rad = math.radians(levels.angle_reading_deg) * readings[0]
        rate_rad_s = levels.rate_reading_rad_s * readings[1]
        gain = 1.0 + levels.acceleration * errors
        workspace_scale = 1.0
        if validation:
            body = self._settings.validation
            strength, offset, narrower, noisier = rng.uniform((-1.0, -1.0, 0.0, 0.0), 1.0).tolist()
            noise_scale = body.noise * noisier
            start = [noise_scale * value for value in start]
            angle_rad = noise_scale * angle_rad + math.radians(body.angle_deg) * offset
            rate_rad_s = noise_scale * rate_rad_s
            gain = (1.0 + noise_scale * (gain - 1.0)) * (1.0 + body.acceleration * strength)
            workspace_scale = 1.0 - body.narrowing * narrower
        compiled = self._compiled is not None  # compiled code reads arrays, a loop in Python lists, sooner
        return RolloutNoise(
            start_angle_rad=math.radians(levels.start_angle_deg) * start[0],
            start_position_m=levels.start_position_m * start[1],
            angle_rad=angle_rad if compiled else angle_rad.tolist(),
            rate_rad_s=rate_rad_s if compiled else rate_rad_s.tolist(),
            gain=gain if compiled else gain.tolist(),
            workspace_scale=workspace_scale,
        )

    def noiseless(self) -> RolloutNoise:
        """No noise: the nominal rollout."""
        none = (0.0,) * self.n_steps
        return RolloutNoise(0.0, 0.0, none, none, (1.0,) * self.n_steps)

    def roll_out(self, actor: Actor, noise: RolloutNoise, on_step: StepCallback | None = None) -> SimulatedRollout:
        """Let ``actor`` swing until the goal, the end of time or, where that ends it, the edge of the workspace."""
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
        """The same from inside out: yields each reading and its time, and is sent the answer.

        The answer is the wanted acceleration and the time before which no further reading is needed.
        """
        settings = self._settings.with_workspace_scale(noise.workspace_scale)
        swing, step_s = self._swing, self._step_s
        limit, goal = limiter(settings).limit, Goal(settings.goal, self.flight)
        edge = settings.workspace.half_width_m
        ends_outside = settings.workspace.kind == "terminate"
        lowest = 0.0 if goal.nearest_rad >= 0.5 * math.pi else -math.inf
        swing.start(SwingState(noise.start_position_m, 0.0, noise.start_angle_rad, 0.0))
        outcome: Outcome = "timeout"
        look_s, peak_m, wanted, gain, decisions = -math.inf, 0.0, 0.0, 1.0, 0
        half_swings, towards, k = 0, 0, 0
        for k in range(self.n_steps):
            t_s = k * step_s
            if t_s >= look_s:
                angle = math.atan2(swing.across_m, -swing.above_m) + noise.angle_rad[k]
                reading = SwingState(swing.x_m, swing.velocity_m_s, angle, rate(swing) + noise.rate_rad_s[k])
                wanted, next_look_s = yield reading, t_s
                if next_look_s != look_s:
                    look_s, gain, decisions = next_look_s, noise.gain[decisions], decisions + 1
            sent = limit(wanted, *swing.reference) * gain
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
            if swing.above_m >= lowest and goal.reached(self.state()):
                outcome = "goal"
                break
        duration_s = (k + 1) * step_s
        swing.check_finite(duration_s)
        return SimulatedRollout(outcome, duration_s, peak_m, half_swings, self.state(), swing.tension_n)

    def state(self) -> SwingState:
        """The true plain state now."""
        swing = self._swing
        angle = math.atan2(swing.across_m, -swing.above_m)
        return SwingState(swing.x_m, swing.velocity_m_s, angle, rate(swing))

    def catch(self, since_s: float, on_step: StepCallback | None = None) -> Catch:
        """Fly on from the goal: the cup heads for the landing until the ball is down at the rim again.

        The acceleration is planned anew in every step, within what the goal calls catchable and the workspace allows.
        """
        if self._compiled is not None and on_step is None:
            return self._compiled.catch()
        swing, step_s = self._swing, self._step_s
        largest = self._settings.goal.catch_acceleration_m_s2
        landing = self._fall()
        steps = 0
        while landing is not None and landing.time_s > 0.5 * step_s and steps < self.n_steps:
            wanted = max(-largest, min(largest, landing.acceleration_m_s2))
            sent = self._limiter.limit(wanted, *swing.reference)
            swing.step(sent)
            steps += 1
            if on_step is not None:
                on_step(since_s + steps * step_s, swing, sent)
            landing = self._fall()
        return Catch(miss_m=abs(swing.across_m), duration_s=steps * step_s)

    def _fall(self) -> Landing | None:
        swing = self._swing
        ball = Ball(swing.across_m, swing.above_m, swing.across_m_s, swing.above_m_s)
        return self.flight.fall(swing.x_m, swing.velocity_m_s, ball)


def _opened(settings: LearnSettings, game: GameSettings) -> tuple[SwingEngine, CompiledRollouts | None]:
    """The engine of ``settings.engine`` and, where it has them, its compiled rollouts."""
    if isinstance(settings.engine, DartEngine):
        from kendama_cli.simulation.swingup.arm import ArmSwing  # noqa: PLC0415 - sweeps on the rail load no DART

        return ArmSwing(settings.engine.robot, settings, game), None
    compiled = CompiledRollouts(settings, game)
    return compiled.swing, compiled
