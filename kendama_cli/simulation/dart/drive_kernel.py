"""The drive, compiled: an arm's controller holds references to the limits of its joints. Arrays (n,), one a joint."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.system.compiled import (
    NONE,
    PAIR,
    READ,
    READ_2D,
    WRITE,
    WRITE_2D,
    Array,
    boolean,
    compiled_as,
    float64,
    int64,
)

LOWER, UPPER, FASTEST, TOP, NEAR_LOWER, NEAR_UPPER = range(6)
"""Rows of the joints' limits (6, n): stops, speed, acceleration, and between which places nothing is near a stop."""
POSITION, VELOCITY, MEAN = range(3)
"""Rows of the drive's state (3, n): its reference now, and the mean speed over the last period."""
ROUNDING = 1e-9
"""Relative room for rounding in an acceleration that is just within its limit."""
LEAST_MARGIN = 0.2
"""Fraction of the acceleration limit that is left for catching up where the reference itself needs nearly all of it."""
CHANGED_RAD = 1e-9
"""A reference that was moved by less than this counts as unchanged."""
BISECTIONS = 40


@compiled_as(float64(float64, float64, float64))
def clipped(value: float, low: float, high: float) -> float:
    """Clip as numpy does, which passes NaN."""
    raised = low if value < low else value
    return high if raised > high else raised


@compiled_as(float64(float64, float64, float64, float64, float64))
def _catching_up(error: float, speed: float, acceleration: float, top: float, period: float) -> float:
    """Return the acceleration beyond the reference's that takes ``error`` and ``speed`` to zero: fhan (see Drive)."""
    maximum = max(top - abs(acceleration), LEAST_MARGIN * top)
    d = maximum * period**2
    a0 = period * speed
    y = error + a0
    if abs(y) <= d:
        a = a0 + y
    else:
        side = 1.0 if y > 0.0 else -1.0
        a = a0 + side * (math.sqrt(d * (d + 8 * abs(y))) - d) / 2
    return -maximum * clipped(a / d, -1.0, 1.0)


@compiled_as(float64(float64, float64, float64))
def _way_to_rest(velocity: float, top: float, period: float) -> float:
    """Return an upper bound of a joint's way until it rests, braking with ``top`` or less for whole periods.

    v^2 / 2 A + A T^2 / 8, where v > A T / 2: the last period brakes with less, and takes up to A T^2 / 8 more.
    """
    if velocity <= 0.0:
        return 0.0
    half = 0.5 * top * period
    return velocity**2 / (2.0 * top) + 0.25 * half * period if velocity > half else 0.5 * velocity * period


@compiled_as(float64(float64, float64, float64, float64))
def _fastest(velocity: float, room: float, top: float, period: float) -> float:
    """Return the maximum velocity after a period of constant acceleration from which ``room`` suffices to stop.

    Where ``room`` was enough for ``velocity``, this is never less than braking with ``top`` reaches.
    """
    left, half = room - 0.5 * period * velocity, 0.5 * top * period
    if left >= half * period:
        return math.sqrt(2.0 * top * left) - half
    return left / period if left >= 0.0 else 2.0 * left / period


@compiled_as(PAIR(float64, float64, READ_2D, float64, int64))
def _speeds(position: float, velocity: float, limits: Array, period: float, i: int) -> tuple[float, float]:
    """Return the minimum and maximum velocity of joint ``i`` one period later that leave it room to brake."""
    fastest, top = limits[FASTEST, i], limits[TOP, i]
    up = min(_fastest(velocity, limits[UPPER, i] - position, top, period), fastest)
    return -min(_fastest(-velocity, position - limits[LOWER, i], top, period), fastest), up


@compiled_as(boolean(float64, float64, float64, float64, READ_2D, float64, int64))
def _keeps_stops(  # noqa: PLR0917
    q0: float, v0: float, q1: float, v1: float, limits: Array, period: float, i: int
) -> bool:
    """Return True if the cubic between both states stays between the stops and ends with room to brake."""
    top, lower, upper = limits[TOP, i], limits[LOWER, i], limits[UPPER, i]
    if q1 + _way_to_rest(v1, top, period) > upper or q1 - _way_to_rest(-v1, top, period) < lower:
        return False
    mean = (q1 - q0) / period
    b, a = 3.0 * mean - 2.0 * v0 - v1, v0 + v1 - 2.0 * mean  # v(u) = v0 + 2 b u + 3 a u^2, u from 0 to 1
    square = b * b - 3.0 * a * v0
    if square <= 0.0:
        return True
    root = math.sqrt(square)
    for sign in (-1.0, 1.0):
        low = -b + sign * root
        u = low / (3.0 * a) if abs(a) > 1e-12 * abs(b) else -0.5 * v0 / b
        if 0.0 < u < 1.0 and not lower <= q0 + period * u * (v0 + u * (b + u * a)) <= upper:
            return False
    return True


@compiled_as(boolean(float64, float64, float64, float64, READ_2D, float64, int64))
def _within(  # noqa: PLR0917
    q0: float, v0: float, q1: float, v1: float, limits: Array, period: float, i: int
) -> bool:
    """Return True if the cubic from ``q0``, ``v0`` to ``q1``, ``v1`` keeps joint ``i`` to all its limits.

        a(0) = (6 m - 4 v0 - 2 v1) / T,   a(T) = (4 v1 + 2 v0 - 6 m) / T,   m = (q1 - q0) / T

    Its acceleration is largest at an end; its speed is so too, or where the acceleration changes its sign.
    """
    fastest, top = limits[FASTEST, i], limits[TOP, i]
    mean, maximum = (q1 - q0) / period, top * period * (1.0 + ROUNDING)
    start, end = 6.0 * mean - 4.0 * v0 - 2.0 * v1, 4.0 * v1 + 2.0 * v0 - 6.0 * mean
    if not (abs(start) <= maximum and abs(end) <= maximum and abs(v1) <= fastest):
        return False
    if start * end < 0.0 and abs(v0 + 0.5 * start * start / (start - end)) > fastest:
        return False
    if limits[NEAR_LOWER, i] <= q1 <= limits[NEAR_UPPER, i]:
        return True
    return _keeps_stops(q0, v0, q1, v1, limits, period, i)


@compiled_as(boolean(float64, float64, float64, WRITE_2D, READ_2D, float64, int64))
def _hold_back(  # noqa: PLR0917
    position: float, velocity: float, acceleration: float, state: Array, limits: Array, period: float, i: int
) -> bool:
    """Move joint ``i`` on by a period of constant acceleration as its limits let it; whether that changes anything."""
    here, last, change = state[POSITION, i], state[VELOCITY, i], limits[TOP, i] * period
    before = position - period * velocity + 0.5 * period**2 * acceleration
    speed = last - (velocity - period * acceleration)
    catching_up = _catching_up(here - before, speed, acceleration, limits[TOP, i], period)
    desired = last + period * (acceleration + catching_up)
    if not math.isfinite(desired):
        desired = 0.0  # to rest
    down, up = _speeds(here, last, limits, period, i)
    # the room to brake is kept from period to period, so this never asks for more than the limit
    held = clipped(clipped(desired, last - change, last + change), down, up)
    place = clipped(here + 0.5 * period * (last + held), limits[LOWER, i], limits[UPPER, i])
    state[POSITION, i], state[VELOCITY, i] = place, held
    return not (abs(place - position) <= CHANGED_RAD and abs(held - velocity) <= CHANGED_RAD / period)


@compiled_as(boolean(READ, READ, READ, WRITE_2D, READ_2D, float64, WRITE))
def follow(  # noqa: PLR0917
    position: Array, velocity: Array, acceleration: Array, state: Array, limits: Array, period: float, change: Array
) -> bool:
    """Follow as Drive.follow: move ``state`` on, put the change of its mean velocity in the period into ``change``."""
    limited = False
    for i in range(position.size):
        before, mean = state[POSITION, i], state[MEAN, i]
        if _within(before, state[VELOCITY, i], position[i], velocity[i], limits, period, i):
            state[POSITION, i], state[VELOCITY, i] = position[i], velocity[i]
        else:
            limited |= _hold_back(position[i], velocity[i], acceleration[i], state, limits, period, i)
        state[MEAN, i] = (state[POSITION, i] - before) / period
        change[i] = (state[MEAN, i] - mean) / period
    return limited


@compiled_as(NONE(READ, READ, READ, READ, READ_2D, float64, WRITE, WRITE))
def nearest_state(  # noqa: PLR0917
    q0: Array, v0: Array, wanted_rad: Array, wanted_rad_s: Array, limits: Array, period: float, q1: Array, v1: Array
) -> None:
    """Limit as devices.robot.limiter.limit_command: ``q1`` and ``v1`` one period after ``q0`` and ``v0``."""
    for i in range(q0.size):
        q, v = wanted_rad[i], wanted_rad_s[i]
        if not _within(q0[i], v0[i], q, v, limits, period, i):
            change = limits[TOP, i] * period
            down, up = _speeds(q0[i], v0[i], limits, period, i)
            v = clipped(clipped(v, v0[i] - change, v0[i] + change), down, up)
            kept = clipped(q0[i] + 0.5 * period * (v0[i] + v), limits[LOWER, i], limits[UPPER, i])
            # the cubics that end with this speed and change it no faster than allowed end between these two places
            level, slack = period * (v0[i] + v) / 2.0, period * max(change - abs(v - v0[i]), 0.0) / 6.0
            far = clipped(q, q0[i] + level - slack, q0[i] + level + slack)
            q = far
            if not _within(q0[i], v0[i], q, v, limits, period, i):
                q = kept
                for _ in range(BISECTIONS):
                    half = 0.5 * (q + far)
                    if _within(q0[i], v0[i], half, v, limits, period, i):
                        q = half
                    else:
                        far = half
        q1[i], v1[i] = q, v


class Drive:
    """Drive that follows a reference of n joints within their limits of position, velocity and acceleration.

    A sample passes unchanged where the cubic from the last one to it keeps to all limits and ends with room to brake.
    Otherwise the joint moves with constant acceleration for one period, chosen by the discrete time-optimal law
    (J. Han, IEEE Trans. Ind. Electron. 56(3), 2009, fhan) on the distance to the reference, then held to the speed
    limit and to

        q + w(v) <= stop,   w(v) = v^2 / 2 A + A T^2 / 8   (v T / 2 where v < A T / 2)

    after every period: w is at least the way on which the joint comes to rest in whole periods of constant
    acceleration, so that from such a state the next one can always be reached by braking with A. Where the reference is
    not finite the joint brakes.

    ``state`` and ``limits`` are the arrays on which the compiled law works (``follow``).
    """

    def __init__(self, limits: JointLimits, period_s: float) -> None:
        self.limits = limit_rows(limits, period_s)
        self.state: Array = np.zeros((3, len(limits.lower_rad)))
        self._period_s = period_s
        self.reset((limits.lower_rad + limits.upper_rad) / 2)

    def reset(self, position_rad: Array, velocity_rad_s: Array | float = 0.0) -> None:
        """Begin at ``position_rad`` (n,), moving with ``velocity_rad_s``, or as near to that as the limits allow."""
        lower, upper, fastest, top = self.limits[: TOP + 1]
        position = np.clip(position_rad, lower, upper)
        # w(v) <= v^2 / 2 A + A T^2 / 8, so that there is room for these speeds
        spare = top * self._period_s**2 / 8
        down, up = (np.sqrt(2 * top * np.maximum(room - spare, 0.0)) for room in (position - lower, upper - position))
        self.state[POSITION] = position
        self.state[VELOCITY] = np.clip(velocity_rad_s, -np.minimum(down, fastest), np.minimum(up, fastest))
        self.state[MEAN] = self.state[VELOCITY]
        self.limited = False
        """True if the last sample was changed."""

    def follow(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array) -> Array:
        """Move on to the reference for the end of the coming period; returns the change (n,) of its mean speed.

        DART moves a joint by its speed at a step's end, so that its speed stands for the middle of the last step.
        """
        change = np.empty(self.state.shape[1])
        reference = (position_rad, velocity_rad_s, acceleration_rad_s2)
        self.limited = bool(follow(*reference, self.state, self.limits, self._period_s, change))
        return change

    @property
    def position_rad(self) -> Array:
        """Present position of the reference (n,)."""
        return np.array(self.state[POSITION])

    @property
    def velocity_rad_s(self) -> Array:
        """Present velocity of the reference (n,)."""
        return np.array(self.state[VELOCITY])


def limit_rows(limits: JointLimits, period_s: float) -> Array:
    """Return the limits (6, n) for compiled code (LOWER and so on) for periods of ``period_s``."""
    lower, upper, fastest = limits.lower_rad, limits.upper_rad, limits.velocity_rad_s
    top = limits.acceleration_rad_s2
    brake = fastest**2 / (2 * top) + top * period_s**2 / 8 + fastest * period_s
    return np.stack([lower, upper, fastest, top, lower + brake, upper - brake])
