"""What happens between two steps of DART, compiled: drive, computed torque and friction over plain arrays.

Arrays (n,) have one value per joint. All compiled code of the arm lives in this one file, because numba's cache of a
function notices changes in its own file only. Exponential and hyperbolic tangent are left to numpy, which the rest of
the program uses: its vectorised ones differ from the C library's in the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

from numba import boolean, float64, int64, njit, types

F = TypeVar("F", bound=Callable[..., Any])
Array = Any
"""A numpy array of float64; compiled code takes no finer annotation."""

LOWER, UPPER, FASTEST, TOP, CHANGE, MOST_CHANGE, MOST_BEND, NEAR_LOWER, NEAR_UPPER = range(9)
"""Rows of the drive's limits (9, n): stops, speed and acceleration limit, the change of speed in one period, what of
speed and place a reference may differ from the last one, and between which places there is room to brake."""
POSITION, VELOCITY, MEAN = range(3)
"""Rows of the drive's state (3, n): its reference now, and the mean speed over the last period."""
SLACK = 1e-6
"""Relative room for rounding in a reference that is just within its limits."""
LEAST_MARGIN = 0.2
"""Share of the acceleration limit that is left for catching up where the reference itself needs nearly all of it."""

COULOMB, STRIBECK, PER_SPEED, VISCOUS, SLOW, EFFORT, PER_NM = range(7)
"""Rows of the joints' constants (7, n): Fc, Fs, 1 / vs, b, the speed from which nothing stops a joint within a step,
the motors' limits, and the change of speed in one step that 1 Nm makes."""
WANTED_FADE, FADE, DIRECTION = range(3)
"""Rows of the friction's terms (3, n): -(v / vs)^2 of the wanted and the present speed, and the wanted speed over
REVERSAL_RAD_S; then their exponentials and hyperbolic tangent."""
STILL_RAD_S = 0.002
"""A joint that a step would leave slower than this may stop in it."""
UNCOMMANDED = 0.5
"""Share of the friction that forces which nobody commanded may take of a joint's speed in one step."""
REVERSAL_RAD_S = 0.02
"""The controller's compensation turns its sign over about this speed."""

FINE, LIMITED, NOT_FINITE = 0, 1, 2
"""What a step may answer: the bits of an integer."""

READ = types.Array(float64, 1, "A", readonly=True)
READ_2D = types.Array(float64, 2, "A", readonly=True)
_types: Any = types
PAIR = _types.UniTuple(float64, 2)
WRITE, WRITE_2D = float64[::1], float64[:, ::1]


def _compiled(signature: Any) -> Callable[[F], F]:
    """One signature for whatever arrays come: others would be compiled anew, in seconds, for every mixture of them."""
    made: Callable[[F], F] = njit(signature, cache=True, error_model="numpy")
    return made


@_compiled(float64(float64, float64, float64))
def _clipped(value: float, low: float, high: float) -> float:
    """As numpy's clip, which lets pass what is no number."""
    raised = low if value < low else value
    return high if raised > high else raised


@_compiled(float64(float64, float64, float64, float64, float64))
def _catching_up(error: float, speed: float, acceleration: float, top: float, period: float) -> float:
    """fhan (see Drive): the acceleration beyond the reference's own that takes ``error`` and ``speed`` to zero."""
    most = max(top - abs(acceleration), LEAST_MARGIN * top)
    d = most * period**2
    a0 = period * speed
    y = error + a0
    if abs(y) <= d:
        a = a0 + y
    else:
        side = 1.0 if y > 0.0 else -1.0
        a = a0 + side * (math.sqrt(d * (d + 8 * abs(y))) - d) / 2
    return -most * _clipped(a / d, -1.0, 1.0)


@_compiled(float64(float64, float64, float64, float64, float64))
def _fastest(velocity: float, room: float, fastest: float, top: float, change: float) -> float:
    """The highest speed toward a stop at the distance ``room`` from which it can still be braked for."""
    half = 0.5 * change
    square = half * half - change * velocity + 2 * top * room
    return min(fastest, math.sqrt(max(square, 0.0)) - half)


@_compiled(boolean(float64, float64, READ_2D, READ_2D, float64, int64))
def _fits(  # noqa: PLR0917 - plain numbers and arrays, as compiled code takes them
    position: float, velocity: float, state: Array, limits: Array, period: float, i: int
) -> bool:
    """Whether joint ``i`` can be at ``position`` with ``velocity`` one period after ``state``."""
    last = state[VELOCITY, i]
    mean = 0.5 * (last + velocity)
    return bool(
        abs(velocity - last) <= limits[MOST_CHANGE, i]
        and abs(position - state[POSITION, i] - period * mean) <= limits[MOST_BEND, i]
    )


@_compiled(boolean(READ, READ, READ_2D, READ_2D, float64))
def _passes(position: Array, velocity: Array, state: Array, limits: Array, period: float) -> bool:
    """Whether every joint can be there, and has room to brake at any speed."""
    for i in range(position.size):
        if not (
            _fits(position[i], velocity[i], state, limits, period, i)
            and abs(velocity[i]) <= limits[FASTEST, i]
            and limits[NEAR_LOWER, i] <= position[i] <= limits[NEAR_UPPER, i]
        ):
            return False
    return True


@_compiled(PAIR(float64, READ_2D, READ_2D, int64))
def _speeds(velocity: float, state: Array, limits: Array, i: int) -> tuple[float, float]:
    """The least and the highest speed that leaves joint ``i`` room to brake."""
    place, fastest, top, change = state[POSITION, i], limits[FASTEST, i], limits[TOP, i], limits[CHANGE, i]
    up = _fastest(velocity, limits[UPPER, i] - place, fastest, top, change)
    return -_fastest(-velocity, place - limits[LOWER, i], fastest, top, change), up


@_compiled(boolean(READ, READ, READ, WRITE_2D, READ_2D, float64))
def _hold_back(  # noqa: PLR0917
    position: Array, velocity: Array, acceleration: Array, state: Array, limits: Array, period: float
) -> bool:
    """Move ``state`` on as far as the limits let every joint; False, with nothing done, where they let all pass."""
    all_fit = True
    for i in range(position.size):
        down, up = _speeds(state[VELOCITY, i], state, limits, i)
        fits = _fits(position[i], velocity[i], state, limits, period, i)
        all_fit = all_fit and fits and down - SLACK <= velocity[i] <= up + SLACK
    if all_fit:
        return False
    for i in range(position.size):
        last, change = state[VELOCITY, i], limits[CHANGE, i]
        down, up = _speeds(last, state, limits, i)
        fits = _fits(position[i], velocity[i], state, limits, period, i)
        if fits and down - SLACK <= velocity[i] <= up + SLACK:
            state[POSITION, i], state[VELOCITY, i] = position[i], velocity[i]
        else:
            before = position[i] - period * velocity[i] + 0.5 * period**2 * acceleration[i]
            speed = last - (velocity[i] - period * acceleration[i])
            error = state[POSITION, i] - before
            catching_up = _catching_up(error, speed, acceleration[i], limits[TOP, i], period)
            wanted = last + period * (acceleration[i] + catching_up)
            # the room to brake is kept exactly from step to step, so this never asks for more than the limit
            held = _clipped(_clipped(wanted, last - change, last + change), down, up)
            place = state[POSITION, i] + 0.5 * period * (last + held)
            state[POSITION, i] = _clipped(place, limits[LOWER, i], limits[UPPER, i])
            state[VELOCITY, i] = held
        state[MEAN, i] = 0.5 * (last + state[VELOCITY, i])
    return True


@_compiled(boolean(READ, READ, READ, WRITE_2D, READ_2D, float64, float64, WRITE))
def follow(  # noqa: PLR0917
    position: Array,
    velocity: Array,
    acceleration: Array,
    state: Array,
    limits: Array,
    period: float,
    per_period: float,
    change: Array,
) -> bool:
    """Drive.follow: moves ``state`` on, puts the change of its mean speed over the period into ``change``."""
    for i in range(position.size):
        change[i] = state[MEAN, i]
    limited = not _passes(position, velocity, state, limits, period)
    if limited:
        limited = _hold_back(position, velocity, acceleration, state, limits, period)
    for i in range(position.size):
        if not limited:
            state[MEAN, i] = 0.5 * (state[VELOCITY, i] + velocity[i])
            state[POSITION, i], state[VELOCITY, i] = position[i], velocity[i]
        change[i] = (state[MEAN, i] - change[i]) * per_period
    return limited


@_compiled(types.void(READ, READ, READ_2D, WRITE_2D))
def friction_terms(wanted_rad_s: Array, velocity_rad_s: Array, joints: Array, terms: Array) -> None:
    """Fill ``terms`` with what numpy shall take the exponential and the hyperbolic tangent of."""
    for i in range(velocity_rad_s.size):
        ratio = wanted_rad_s[i] * joints[PER_SPEED, i]
        terms[WANTED_FADE, i] = -ratio * ratio
        ratio = velocity_rad_s[i] * joints[PER_SPEED, i]
        terms[FADE, i] = -ratio * ratio
        terms[DIRECTION, i] = wanted_rad_s[i] * (1.0 / REVERSAL_RAD_S)


@_compiled(int64(READ, READ, READ, READ, READ, READ, WRITE_2D, READ_2D, READ_2D, READ, WRITE, WRITE_2D))
def computed_torque(  # noqa: PLR0917
    position: Array,
    velocity: Array,
    acceleration: Array,
    noise: Array,
    position_rad: Array,
    velocity_rad_s: Array,
    state: Array,
    limits: Array,
    joints: Array,
    gains: Array,
    wanted: Array,
    terms: Array,
) -> int:
    """The accelerations ``wanted`` that ArmWorld's law asks of the joints, and the friction's ``terms`` for them.

    ``gains`` are Kp, Kd, the period and its inverse; errors are those before the drive moves on.
    """
    kp, kd, period, per_period = gains
    errors = wanted.copy()
    for i in range(wanted.size):
        errors[i] = kd * (state[MEAN, i] - velocity_rad_s[i])
        errors[i] += kp * (state[POSITION, i] - position_rad[i] - noise[i])
    answer = LIMITED if follow(position, velocity, acceleration, state, limits, period, per_period, wanted) else FINE
    for i in range(wanted.size):
        wanted[i] = errors[i] + wanted[i]
        if not math.isfinite(wanted[i]):
            answer |= NOT_FINITE
    friction_terms(state[MEAN], velocity_rad_s, joints, terms)
    return answer


@_compiled(boolean(float64, float64, float64, float64))
def _slides_on(speed: float, change: float, friction: float, moved: float) -> bool:
    """Whether a joint with ``speed`` goes on in its direction through the step, so that friction is known beforehand.

    ``change`` is what the motors make of its speed, ``friction`` what friction does, both in one step; ``moved`` is how
    much of what friction does is left for what nobody commanded, the rope's pull say.
    """
    side = 1.0 if speed > 0.0 else -1.0
    return side * (speed + change) - friction > moved * friction + STILL_RAD_S


@_compiled(boolean(READ, READ, READ, READ, float64, READ_2D, READ_2D, READ, WRITE, WRITE, WRITE))
def efforts(  # noqa: PLR0917
    torque: Array,
    added: Array,
    velocity_rad_s: Array,
    wanted: Array,
    period: float,
    joints: Array,
    terms: Array,
    unknown: Array,
    effort: Array,
    force: Array,
    held: Array,
) -> bool:
    """What the motors give for ``torque``, and what then acts on the joints; False where it is not finite.

    ``torque`` is what gives the accelerations ``wanted`` without friction.
    ``effort`` is the torque with the compensation of the known friction and what is ``added``, within the motors'
    limits; ``force`` is that with the friction of fast joints, ``held`` (n,) the level up to which DART's constraint
    holds the others. ``unknown`` is the factor on all friction and the Coulomb friction beyond it.
    """
    factor, extra = unknown
    finite = True
    for i in range(torque.size):
        v = velocity_rad_s[i]
        known = (joints[COULOMB, i] + joints[STRIBECK, i] * terms[WANTED_FADE, i]) * terms[DIRECTION, i]
        given = torque[i] + (known + joints[VISCOUS, i] * v) + added[i]
        effort[i] = given
        if math.isfinite(given):
            effort[i] = _clipped(given, -joints[EFFORT, i], joints[EFFORT, i])
        else:
            finite = False
        level = factor * joints[COULOMB, i] + extra + factor * joints[STRIBECK, i] * terms[FADE, i]
        per_nm = joints[PER_NM, i]
        change = period * wanted[i] + per_nm * (effort[i] - torque[i] - joints[VISCOUS, i] * v)
        fast = abs(v) > joints[SLOW, i] or (per_nm > 0.0 and _slides_on(v, change, per_nm * level, UNCOMMANDED))
        held[i] = 0.0 if fast else level
        force[i] = effort[i] - math.copysign(level, v) if fast else effort[i]
    return finite
