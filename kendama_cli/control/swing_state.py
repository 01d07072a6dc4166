"""Estimation of the state that the policy acts on, from tracked positions of cup and ball."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.devices.robot.interface import RobotState
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.taut_rope import TautRope, rope_angle
from kendama_cli.schema.arrays import Array


class SwingStateEstimator:
    """Estimator that follows cup and ball through the last ``samples`` readings of each, ``period_s`` apart.

    The accelerations are known: the cup's from the commands, the ball's about the tie point from the pendulum on the
    taut rope round the cup (TautRope),

        phi'' = -(g sin phi + a cos phi) / l   under the cup,

    which does not depend on the rope's tension, so that it holds for one that has just gone slack too. What they add
    since the oldest reading is taken off, and a straight line (least squares) goes through the rest: its slope has a
    quarter of the noise that the parabola needed for an unknown acceleration would have.

    ``center_m`` (3,) is the world position where the cup's x is zero, ``direction`` (3,) the unit vector of x,
    ``rope`` the real rope; the ball's angle is that of the line from tie point to ball, unwrapped from
    reading to reading. Raises ValueError for fewer than two samples.
    """

    def __init__(
        self, period_s: float, samples: int, center_m: Array, direction: Array, *, rope: TautRope, gravity_m_s2: float
    ) -> None:
        if samples < 2:
            raise ValueError(f"a line needs at least 2 samples, not {samples}")
        self._center_m = np.asarray(center_m, dtype=np.float64)
        self._direction = np.asarray(direction, dtype=np.float64)
        self._rope, self._gravity_m_s2 = rope, gravity_m_s2
        self._x, self._angle = _LineFit(period_s, samples), _LineFit(period_s, samples)
        self._rate = 0.0

    def begin(self) -> None:
        """Forget everything: the next reading begins a new rollout."""
        self._x.begin()
        self._angle.begin()
        self._rate = 0.0

    def update(self, state: RobotState, acceleration_m_s2: float) -> SwingState:
        """Return the swing's state after one more reading; the cup has accelerated so since the reading before."""
        ball_m = state.ball_in_world_m - state.cup_in_world_m
        angle = rope_angle(float(self._direction @ ball_m), float(ball_m[2]))
        before = self._angle.newest
        angle += 2.0 * math.pi * round((before - angle) / (2.0 * math.pi))
        center = 0.5 * (before + angle)
        turning = self._rope.acceleration_rad_s2(center, self._rate, acceleration_m_s2, self._gravity_m_s2)
        x, velocity = self._x.update(
            float(self._direction @ (state.cup_in_world_m - self._center_m)), acceleration_m_s2
        )
        angle, self._rate = self._angle.update(angle, turning)
        return SwingState(x, velocity, math.remainder(angle, 2.0 * math.pi), self._rate)


class _LineFit:
    """Value and slope of one number whose acceleration between readings is known.

    With y_k the n readings less what the accelerations have added since the oldest, the line's slope is
    12 sum((k - (n - 1) / 2) y_k) / (n (n^2 - 1) h).
    """

    def __init__(self, period_s: float, samples: int) -> None:
        self._period_s = period_s
        self._samples = samples
        self.begin()

    def begin(self) -> None:
        self._readings: list[float] = []
        self._accelerations: list[float] = []

    @property
    def newest(self) -> float:
        """Last reading; 0 before the first."""
        return self._readings[-1] if self._readings else 0.0

    def update(self, reading: float, acceleration: float) -> tuple[float, float]:
        """Return value and slope at this ``reading``; ``acceleration`` held since the one before."""
        self._readings.append(reading)
        self._accelerations.append(acceleration)
        if len(self._readings) > self._samples:
            del self._readings[0], self._accelerations[0]
        n, h = len(self._readings), self._period_s
        gained = travelled = total = moment = 0.0
        for k, (value, known) in enumerate(zip(self._readings, self._accelerations, strict=True)):
            if k:
                travelled += h * (gained + 0.5 * h * known)
                gained += h * known
            rest = value - travelled
            total += rest
            moment += (k - 0.5 * (n - 1)) * rest
        slope = 12.0 * moment / (n * (n * n - 1) * h) if n > 1 else 0.0
        return total / n + 0.5 * (n - 1) * h * slope + travelled, slope + gained
