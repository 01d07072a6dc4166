"""The environment of the swing-up: rollouts of any actor with noise and limits, the release and the flight."""

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
from kendama_cli.physics.free_fall import Landing
from kendama_cli.physics.rim_crossing import at_rim_m, falls, falls_in, is_caught
from kendama_cli.physics.taut_rope import Ball, rope_angle
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.engine import (
    StepCallback,
    SwingEngine,
    catch_limiter,
    limiter,
    mouth_m,
    rate,
    state_of,
)
from kendama_cli.simulation.swingup.rail import CompiledRollouts
from kendama_cli.simulation.swingup.rollout import Catch, RolloutNoise, SimulatedRollout, draw_noise, no_noise

LONGEST_FLIGHT = 1000
"""Steps after which a flight is given up."""
SETTLING_S = 0.3
"""So long after coming down to the rim the ball must still be in a cup that touches it: a bounce out takes less."""


class Release:
    """Watcher of one rollout: told every step, it says when the swing-up is over, by the true state and rope."""

    def __init__(self, settings: LearnSettings, goal: Goal) -> None:
        desired = settings.goal
        self._goal = goal
        self._caught = desired.success == "caught"
        self._steps = max(1, round(desired.slack_s / settings.step_s))
        self._slack = 0
        self._lowest = 0.0 if goal.window.nearest_rad >= 0.5 * math.pi else -math.inf

    def after(self, swing: SwingEngine) -> bool:
        """Return True if the swing-up ends with this step."""
        if swing.above_m < self._lowest:
            self._slack = 0
            return False
        if not self._caught:
            return self._goal.reached(state_of(swing))
        slack = self._goal.in_window(state_of(swing)) and swing.tension_n == 0.0
        self._slack = self._slack + 1 if slack else 0
        return self._slack >= self._steps


def fly(
    swing: SwingEngine, settings: LearnSettings, game: GameSettings, since_s: float, on_step: StepCallback | None
) -> Catch:
    """Fly on: the cup heads for the landing, within its limits, until the ball is down at the rim again.

    The acceleration is planned anew in every step for a ball that falls freely; rope and air are in the dynamics.
    Where ball and cup touch, the cup then comes to rest, and the ball that came down into its mouth must stay in it
    (is_caught). Where they do not, the ball is caught whose centre comes down through the rim's plane so that the ball
    touches nothing.
    """
    radius_m = game.ball.radius_m
    flight, maximum, step_s = Flight.of(game), settings.goal.catch_acceleration_m_s2, settings.step_s
    limit = catch_limiter(settings).limit
    edge_m = settings.workspace.half_width_m if settings.workspace.kind == "terminate" else math.inf
    steps, at_rim = 0, None

    def advance(wanted_m_s2: float) -> None:
        nonlocal steps, at_rim
        before = swing.across_m, 0.0, swing.above_m - flight.rim_m
        sent = limit(max(-maximum, min(maximum, wanted_m_s2)), *swing.reference)
        swing.step(sent)
        now = swing.across_m, 0.0, swing.above_m - flight.rim_m
        if at_rim is None and falls(before[2] - radius_m, now[2] - radius_m):
            at_rim = at_rim_m(before, now)
        steps += 1
        if on_step is not None:
            on_step(since_s + steps * step_s, swing, sent)

    landing = _fall(swing, flight)
    while landing is not None and landing.time_s > 0.5 * step_s and steps < LONGEST_FLIGHT and abs(swing.x_m) <= edge_m:
        advance(landing.acceleration_m_s2)
        landing = _fall(swing, flight)
    miss_m, duration_s = abs(swing.across_m), steps * step_s
    if swing.in_cup is None:
        state = swing.x_m, swing.across_m, swing.above_m - flight.rim_m, swing.above_m_s
        return Catch(miss_m, duration_s, falls_in(*state, mouth_m=mouth_m(game), edge_m=edge_m, step_s=step_s))
    for _ in range(round(SETTLING_S / step_s)):
        advance(-swing.reference[1] / step_s)
    if at_rim is not None:
        miss_m = abs(at_rim[0])
    return Catch(miss_m, duration_s, is_caught(bool(swing.in_cup), at_rim, game.cup.radius_m))


def _fall(swing: SwingEngine, flight: Flight) -> Landing | None:
    ball = Ball(swing.across_m, swing.above_m, swing.across_m_s, swing.above_m_s)
    return flight.fall(swing.x_m, swing.velocity_m_s, ball)


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
