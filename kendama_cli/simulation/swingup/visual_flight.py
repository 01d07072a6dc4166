"""The flight after a release, caught as in a game: the cup knows the ball by late, noisy measurements."""

from __future__ import annotations

import math
from collections.abc import Iterable

from numpy.random import Generator

from kendama_cli.learning.reward import Flight
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.rim_crossing import falls_in
from kendama_cli.physics.taut_rope import Ball
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.engine import catch_limiter, mouth_m
from kendama_cli.simulation.swingup.rail import CompiledRail

LONGEST_FLIGHT_S = 2.0


class FlightEstimate:
    """Least squares of a free fall from measured positions (x, z) with equal errors along both axes.

    With p(t) = p0 + v0 t + g t^2 / 2, the unknowns p0, v0 have a first estimate with its errors: the reading at the
    release. Plain numbers, as a flight asks for it in every time step.
    """

    def __init__(self, read: Ball, gravity_m_s2: float, sigma_m: float, sigma_m_s: float) -> None:
        """Begin with the ball as it was ``read`` at the release, its position and velocity in the world."""
        self._gravity = 0.0, -gravity_m_s2
        self._squares = [sigma_m**-2, 0.0, sigma_m_s**-2]
        start, velocity = (read.across_m, read.above_m), (read.across_m_s, read.above_m_s)
        self._right = [[p * sigma_m**-2, v * sigma_m_s**-2] for p, v in zip(start, velocity, strict=True)]
        self._solved = list(zip(start, velocity, strict=True))

    def add(self, t_s: float, position_m: Iterable[float], sigma_m: float) -> None:
        """Take one measurement, of ``t_s`` after the release."""
        weight = sigma_m**-2
        for i, gain in enumerate((1.0, t_s, t_s * t_s)):
            self._squares[i] += weight * gain
        a, b, c = self._squares
        for axis, (position, gravity, right) in enumerate(zip(position_m, self._gravity, self._right, strict=True)):
            over = position - 0.5 * gravity * t_s * t_s
            right[0] += weight * over
            right[1] += weight * over * t_s
            u, v = right
            self._solved[axis] = (c * u - b * v) / (a * c - b * b), (a * v - b * u) / (a * c - b * b)

    def ball(self, t_s: float) -> Ball:
        """Return the ball at ``t_s``, its position and velocity in the world."""
        (x, x_rate), (z, z_rate) = self._solved
        g = self._gravity[1]
        return Ball(x + x_rate * t_s, z + z_rate * t_s + 0.5 * g * t_s * t_s, x_rate, z_rate + g * t_s)


def caught_by_sight(released: SwingState, settings: LearnSettings, game: GameSettings, rng: Generator) -> bool:
    """Return True if the cup catches the ball that was ``released``, on the rail, by the sensor of ``learn.sensor``.

    As in ``environment.fly`` the cup plans its acceleration anew in every step, here for the estimated ball: that of
    the reading at the release, with the errors of ``learn.noise``, improved by each measurement as it arrives.
    """
    sensor, noise = settings.sensor, settings.noise
    swing, flight = CompiledRail(game, settings.step_s), Flight.of(game)
    swing.start(released)
    limit, maximum, step_s = catch_limiter(settings).limit, settings.goal.catch_acceleration_m_s2, settings.step_s
    edge_m = settings.workspace.half_width_m if settings.workspace.kind == "terminate" else math.inf
    angle_error, rate_error = math.radians(noise.angle_reading_deg), noise.rate_reading_rad_s
    angle = released.angle_rad + angle_error * rng.standard_normal()
    read = flight.rope.ball(angle, released.rate_rad_s + rate_error * rng.standard_normal())
    rope_m = game.rope.length_m
    estimate = FlightEstimate(
        Ball(released.x_m + read.across_m, read.above_m, released.velocity_m_s + read.across_m_s, read.above_m_s),
        game.gravity_m_s2,
        max(rope_m * angle_error, sensor.sigma_m),
        max(rope_m * rate_error, sensor.sigma_m * sensor.rate_hz),
    )
    coming: list[tuple[float, list[float]]] = []
    measured, steps = 0, 0
    while steps * step_s < LONGEST_FLIGHT_S and abs(swing.x_m) <= edge_m:
        ball = Ball(swing.across_m, swing.above_m, swing.across_m_s, swing.above_m_s)
        true = flight.fall(swing.x_m, swing.velocity_m_s, ball)
        if true is None or true.time_s <= 0.5 * step_s:
            break
        t_s = steps * step_s
        if t_s * sensor.rate_hz >= measured:
            error = (sensor.sigma_m * rng.standard_normal(2)).tolist()
            coming.append((t_s, [swing.x_m + ball.across_m + error[0], ball.above_m + error[1]]))
            measured += 1
        while coming and coming[0][0] + sensor.latency_s <= t_s:
            estimate.add(*coming.pop(0), sensor.sigma_m)
        seen = estimate.ball(t_s)
        known = Ball(seen.across_m - swing.x_m, seen.above_m, seen.across_m_s - swing.velocity_m_s, seen.above_m_s)
        found = flight.fall(swing.x_m, swing.velocity_m_s, known)
        wanted = 0.0 if found is None else max(-maximum, min(maximum, found.acceleration_m_s2))
        swing.step(limit(wanted, *swing.reference))
        steps += 1
    over_m = swing.above_m - flight.rim_m
    return falls_in(swing.x_m, swing.across_m, over_m, swing.above_m_s, mouth_m(game), edge_m, step_s)
