"""Limits of a joint position command from one millisecond to the next: velocity, acceleration, jerk, room to stop."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array

CATCH_UP_1_S = 15.0
"""How fast what the limits took away is made up for, as a share of it per second."""

FOLLOW_1_S = 60.0
"""How fast a difference in speed is made up for; quicker changes are more than a late answer can hide."""
BRAKING_SHARE = 0.8
"""Of the acceleration limit, for braking toward a stop; the rest is for what braking comes late."""
CAUGHT_UP_RAD = 1e-8
"""So near to the reference, what is sent is the reference: made up in one step, this asks for 0.01 rad/s^2."""


@dataclass(frozen=True)
class RateLimits:
    """Limits of n joints, every array (n,); ``way`` from its stop a joint is at most as fast as

    sqrt(2 stop_rad_s2 way) - stop_rad_s
    """

    lower_rad: Array
    upper_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array
    jerk_rad_s3: Array
    stop_rad_s2: Array
    stop_rad_s: Array


@dataclass(frozen=True)
class LimiterState:
    """Last position sent with its velocity and acceleration, and the reference and its velocity then (n,)."""

    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array
    reference_rad: Array
    reference_rad_s: Array


class RateLimiter:
    """Limiter that follows a reference in steps of ``step_s`` as far as the limits let it.

    With the reference r and what is sent q, v, a of step k:

        s_k = (r_k - r_{k-1}) / h
        a = clip((s_k - s_{k-1}) / h + FOLLOW (s_k + CATCH_UP (r_{k-1} - q_{k-1}) - v_{k-1}))
        v_k = v_{k-1} + a h,   q_k = q_{k-1} + v_k h

    where a keeps to the jerk limit J, to the acceleration limit A, and to J / A times the way that is left to the speed
    limit, which falls toward the joint's stops (see RateLimits). What is with its reference already, and can go on so
    within the limits, is sent as it is.
    """

    def __init__(self, limits: RateLimits, start_rad: Array, step_s: float) -> None:
        self._limits, self._step_s = limits, step_s
        start, rest = np.array(start_rad, dtype=np.float64), np.zeros(len(start_rad))
        self.state = LimiterState(start, rest, rest, start, rest)

    @property
    def position_rad(self) -> Array:
        """Return the position of the last command (n,)."""
        return self.state.position_rad

    @property
    def velocity_rad_s(self) -> Array:
        """Return the velocity of the last command (n,)."""
        return self.state.velocity_rad_s

    @property
    def acceleration_rad_s2(self) -> Array:
        """Return the acceleration of the last command (n,)."""
        return self.state.acceleration_rad_s2

    def follow(self, reference_rad: Array) -> Array:
        """Return the command (n,) for the next reference (n,)."""
        limits, step_s, last = self._limits, self._step_s, self.state
        speed = last.velocity_rad_s
        rate, behind = (reference_rad - last.reference_rad) / step_s, last.reference_rad - last.position_rad
        with_it = (np.abs(behind) < CAUGHT_UP_RAD) & (np.abs(last.reference_rad_s - speed) < CAUGHT_UP_RAD / step_s)
        softly = (rate - last.reference_rad_s) / step_s + FOLLOW_1_S * (rate + CATCH_UP_1_S * behind - speed)
        asked = np.where(with_it, (rate - speed) / step_s, softly)
        most, change = limits.acceleration_rad_s2, limits.jerk_rad_s3 * step_s
        soft = limits.jerk_rad_s3 / most
        ahead = last.position_rad + speed / soft  # where it will be when braking has set in
        up, down = self._room(limits.upper_rad - ahead), self._room(ahead - limits.lower_rad)
        given = np.clip(asked, last.acceleration_rad_s2 - change, last.acceleration_rad_s2 + change)
        given = np.clip(given, np.maximum(-most, soft * (-down - speed)), np.minimum(most, soft * (up - speed)))
        free = with_it & (np.abs(given - asked) < 1e-9)
        position = np.where(free, reference_rad, last.position_rad + (speed + given * step_s) * step_s)
        reached = (position - last.position_rad) / step_s
        self.state = LimiterState(position, reached, (reached - speed) / step_s, np.array(reference_rad, float), rate)
        return position

    def rebase(self, reference_rad: Array) -> None:
        """Set the reference of the step before to ``reference_rad`` (n,), wherever the arm was sent."""
        self.state = dataclasses.replace(self.state, reference_rad=np.array(reference_rad, dtype=np.float64))

    def coasted(self, steps: int) -> LimiterState:
        """Return the state after ``steps`` more steps with the last acceleration and the same reference."""
        last = self.state
        change = last.acceleration_rad_s2 * self._step_s
        way = (steps * last.velocity_rad_s + steps * (steps + 1) / 2 * change) * self._step_s
        return dataclasses.replace(
            last, position_rad=last.position_rad + way, velocity_rad_s=last.velocity_rad_s + steps * change
        )

    def _room(self, way_rad: Array) -> Array:
        limits = self._limits
        brake = np.minimum(limits.stop_rad_s2, BRAKING_SHARE * limits.acceleration_rad_s2)
        braked = np.sqrt(2 * brake * np.maximum(way_rad, 0.0)) - limits.stop_rad_s
        return np.asarray(np.clip(braked, 0.0, limits.velocity_rad_s))
