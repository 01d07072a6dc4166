"""What happens between two steps of DART, compiled: drive, computed torque, friction and rope over plain arrays.

Arrays (n,) have one value per joint.
"""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.artifacts.friction_model import dry_friction
from kendama_cli.physics.air import drag_n
from kendama_cli.physics.rope import CupProfile, RopeLaw, rope_pull
from kendama_cli.robot_model.chain_kernel import rotated_row
from kendama_cli.robot_model.friction import direction
from kendama_cli.system.compiled import (
    NONE,
    PAIR,
    READ,
    READ_2D,
    WRITE,
    WRITE_2D,
    Array,
    boolean,
    compiled,
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
"""Share of the acceleration limit that is left for catching up where the reference itself needs nearly all of it."""
CHANGED_RAD = 1e-9
"""A reference that was moved by less than this counts as unchanged."""
BISECTIONS = 40
MOST_PIVOTS = 200

COULOMB, STRIBECK, PER_SPEED, VISCOUS, EFFORT = range(5)
"""Rows of the joints' constants (5, n): Fc, Fs, 1 / vs, b, the motors' limits."""

AXIS, ORIGIN, CENTER, INERTIA, MASS, ROTOR = 0, 3, 6, 9, 18, 19
"""Columns of the links (n, 20) in the posture of zeros, in the world: a joint's axis and a point of it, its link's
centre of mass, the inertia about that, row by row, and the mass; and the joint's rotor, which counts in H alone."""
NEAR_M, NEAR_S, NEAR_RAD, NEAR_SPEED = 0.02, 0.002, 0.02, 0.9
"""In one step of 1 ms no part of an arm comes nearer than the first to a ball that stands, a moving ball in addition no
nearer than its way in the second; no joint goes farther than the third, or from the fourth of its top speed to all."""

TENSION, REACTION, PIVOT, SIDE = 3, 4, 7, 10
"""Where in ``pulled`` (13,) these begin: the rope's force on the ball (3), its size, the opposite force on the cup (3)
and where in the world it acts (3), and the direction (3) in which the rope last left the cup's axis."""
FAR_AWAY = 1e4
"""A ball farther away or faster than this, in m and m/s, has left the domain of the model."""
HEIGHT, ON_WALL = 12, 13
"""Where in the rope's numbers the height over the cup's place stands at which the cup's axis is taken, and, with a tie
on the wall, that tie's height."""
ROOT, MIDDLE, TIE, OVER, KNOT = range(5)
"""Marks on the last link: its joint's origin, the cup's middle, its place (the tie, if on the axis), the point of the
axis 1 m over it, and a tie on the wall."""

NODE, NODE_SPEED, NODE_KG, NODE_M = 0, 3, 6, 7
"""Columns of a chain's nodes: place, velocity, mass, and the length of the link that ends there."""
CHAIN_STEPS, CHAIN_PERIOD, CHAIN_GRAVITY, CHAIN_SLACK, CHAIN_CARRIED, CHAIN_BEGUN, CHAIN_TIE, CHAIN_OVER, CHAIN_BALL = (
    0, 1, 2, 3, 4, 5, 6, 9, 12,
)  # fmt: skip
"""Where in a chain's numbers (15,) these begin: sub-steps, the world's step, gravity, the pull below which the rope
counts as slack, whether the cup's speeds are those of the coming step, whether there was a step before, the speeds of
tie and axis in it (3), and the ball's that should have come of it (3)."""
LINK_N_M, LINK_S = 2e6, 1e-4
"""A link that does not stretch: 1 um under 2 N; what it was stretched is lost within the time."""
CONTACT_N_M, CONTACT_S = 1e5, 2e-4
"""The cup's surface under a node of the chain: 20 um under 2 N; a node comes out within the time."""
ROUNDED_M = 0.0005
"""Radius of the cup's edges under a chain with mass."""
MOST_ADDED = 12

FINE, LIMITED, NOT_FINITE, NEAR, LOST, GONE = 0, 1, 2, 4, 8, 16
"""What a step may answer: the bits of an integer."""


@compiled_as(float64(float64, float64, float64))
def _clipped(value: float, low: float, high: float) -> float:
    """As numpy's clip, which lets pass what is no number."""
    raised = low if value < low else value
    return high if raised > high else raised


@compiled_as(float64(float64, float64, float64, float64, float64))
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


@compiled_as(float64(float64, float64, float64))
def _way_to_rest(velocity: float, top: float, period: float) -> float:
    """At least the way that a joint moves on until it rests, braking with ``top`` or less for whole periods.

    v^2 / 2 A + A T^2 / 8, where v > A T / 2: the last period brakes with less, and takes up to A T^2 / 8 more.
    """
    if velocity <= 0.0:
        return 0.0
    half = 0.5 * top * period
    return velocity**2 / (2.0 * top) + 0.25 * half * period if velocity > half else 0.5 * velocity * period


@compiled_as(float64(float64, float64, float64, float64))
def _fastest(velocity: float, room: float, top: float, period: float) -> float:
    """The highest speed at the end of a period of constant acceleration after which ``room`` is enough to come to rest.

    Where ``room`` was enough for ``velocity``, this is never less than braking with ``top`` reaches.
    """
    left, half = room - 0.5 * period * velocity, 0.5 * top * period
    if left >= half * period:
        return math.sqrt(2.0 * top * left) - half
    return left / period if left >= 0.0 else 2.0 * left / period


@compiled_as(PAIR(float64, float64, READ_2D, float64, int64))
def _speeds(position: float, velocity: float, limits: Array, period: float, i: int) -> tuple[float, float]:
    """The least and the highest speed of joint ``i`` one period later that leave it room to brake."""
    fastest, top = limits[FASTEST, i], limits[TOP, i]
    up = min(_fastest(velocity, limits[UPPER, i] - position, top, period), fastest)
    return -min(_fastest(-velocity, position - limits[LOWER, i], top, period), fastest), up


@compiled_as(boolean(float64, float64, float64, float64, READ_2D, float64, int64))
def _keeps_stops(  # noqa: PLR0917
    q0: float, v0: float, q1: float, v1: float, limits: Array, period: float, i: int
) -> bool:
    """Whether the cubic between both states stays between the stops and ends with room to brake."""
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
    """Whether the cubic from place ``q0`` and speed ``v0`` to ``q1`` and ``v1`` keeps joint ``i`` to all its limits.

        a(0) = (6 m - 4 v0 - 2 v1) / T,   a(T) = (4 v1 + 2 v0 - 6 m) / T,   m = (q1 - q0) / T

    Its acceleration is largest at an end; its speed is so too, or where the acceleration changes its sign.
    """
    fastest, top = limits[FASTEST, i], limits[TOP, i]
    mean, most = (q1 - q0) / period, top * period * (1.0 + ROUNDING)
    begin, end = 6.0 * mean - 4.0 * v0 - 2.0 * v1, 4.0 * v1 + 2.0 * v0 - 6.0 * mean
    if not (abs(begin) <= most and abs(end) <= most and abs(v1) <= fastest):
        return False
    if begin * end < 0.0 and abs(v0 + 0.5 * begin * begin / (begin - end)) > fastest:
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
    wanted = last + period * (acceleration + catching_up)
    if not math.isfinite(wanted):
        wanted = 0.0  # to rest
    down, up = _speeds(here, last, limits, period, i)
    # the room to brake is kept from period to period, so this never asks for more than the limit
    held = _clipped(_clipped(wanted, last - change, last + change), down, up)
    place = _clipped(here + 0.5 * period * (last + held), limits[LOWER, i], limits[UPPER, i])
    state[POSITION, i], state[VELOCITY, i] = place, held
    return not (abs(place - position) <= CHANGED_RAD and abs(held - velocity) <= CHANGED_RAD / period)


@compiled_as(boolean(READ, READ, READ, WRITE_2D, READ_2D, float64, WRITE))
def follow(  # noqa: PLR0917
    position: Array, velocity: Array, acceleration: Array, state: Array, limits: Array, period: float, change: Array
) -> bool:
    """Drive.follow: moves ``state`` on, puts the change of its mean speed over the period into ``change``."""
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
    """devices.robot.limiter.limit_command: places ``q1`` and speeds ``v1`` one period after ``q0`` and ``v0``."""
    for i in range(q0.size):
        q, v = wanted_rad[i], wanted_rad_s[i]
        if not _within(q0[i], v0[i], q, v, limits, period, i):
            change = limits[TOP, i] * period
            down, up = _speeds(q0[i], v0[i], limits, period, i)
            v = _clipped(_clipped(v, v0[i] - change, v0[i] + change), down, up)
            kept = _clipped(q0[i] + 0.5 * period * (v0[i] + v), limits[LOWER, i], limits[UPPER, i])
            # the cubics that end with this speed and change it no faster than allowed end between these two places
            level, slack = period * (v0[i] + v) / 2.0, period * max(change - abs(v - v0[i]), 0.0) / 6.0
            far = _clipped(q, q0[i] + level - slack, q0[i] + level + slack)
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


@compiled_as(int64(READ, READ, READ, READ, READ, READ, WRITE_2D, READ_2D, READ, READ_2D, READ, WRITE))
def computed_torque(  # noqa: PLR0917
    position: Array,
    velocity: Array,
    acceleration: Array,
    noise: Array,
    position_rad: Array,
    velocity_rad_s: Array,
    state: Array,
    limits: Array,
    gains: Array,
    inertia: Array,
    bias: Array,
    torque: Array,
) -> int:
    """The ``torque`` that ArmWorld's law commands without friction, from ``inertia`` H and ``bias`` C q' + g.

    ``gains`` are Kp, Kd and the period; errors are those before the drive moves on. A reference that is not finite lets
    the drive brake, and its joint's answer is not finite.
    """
    kp, kd, period = gains
    n = torque.size
    errors, wanted = np.empty(n), np.empty(n)
    for i in range(n):
        errors[i] = kd * (state[MEAN, i] - velocity_rad_s[i])
        errors[i] += kp * (state[POSITION, i] - position_rad[i] - noise[i])
    answer = LIMITED if follow(position, velocity, acceleration, state, limits, period, wanted) else FINE
    for i in range(n):
        wanted[i] += errors[i]
    for i in range(n):
        torque[i] = bias[i]
        for j in range(n):
            torque[i] += inertia[i, j] * wanted[j]
        if not math.isfinite(torque[i] + position[i] + velocity[i] + acceleration[i]):
            torque[i] = math.nan
            answer |= NOT_FINITE
    return answer


@compiled_as(boolean(READ, READ, READ, READ, READ_2D, READ, WRITE, WRITE))
def efforts(  # noqa: PLR0917
    torque: Array,
    added: Array,
    velocity_rad_s: Array,
    wanted_rad_s: Array,
    joints: Array,
    unknown: Array,
    effort: Array,
    level: Array,
) -> bool:
    """What the motors give for ``torque``, and what friction may take; False where the first is not finite.

    ``effort`` is the torque with the compensation of the known friction for the speeds ``wanted_rad_s`` and what is
    ``added``, within the motors' limits; ``level`` the dry friction of every joint. ``unknown`` is the factor on all
    friction and the Coulomb friction beyond it.
    """
    factor, extra = unknown
    finite = True
    for i in range(torque.size):
        ratio = wanted_rad_s[i] * joints[PER_SPEED, i]
        dry = dry_friction(joints[COULOMB, i], joints[STRIBECK, i], ratio)
        known = dry * direction(wanted_rad_s[i]) + joints[VISCOUS, i] * velocity_rad_s[i]
        given = torque[i] + known + added[i]
        effort[i] = given
        if math.isfinite(given):
            effort[i] = _clipped(given, -joints[EFFORT, i], joints[EFFORT, i])
        else:
            finite = False
        ratio = velocity_rad_s[i] * joints[PER_SPEED, i]
        level[i] = factor * dry_friction(joints[COULOMB, i], joints[STRIBECK, i], ratio) + extra
    return finite


@compiled_as(
    int64(READ, READ, READ, READ, READ, READ, READ, WRITE_2D, READ_2D, READ, READ_2D, READ, READ_2D, READ, WRITE, WRITE)
)
def command(  # noqa: PLR0917
    position: Array,
    velocity: Array,
    acceleration: Array,
    noise: Array,
    added: Array,
    position_rad: Array,
    velocity_rad_s: Array,
    state: Array,
    limits: Array,
    gains: Array,
    joints: Array,
    unknown: Array,
    inertia: Array,
    bias: Array,
    effort: Array,
    level: Array,
) -> int:
    """``computed_torque`` and what the motors make of it (``efforts``)."""
    torque = np.empty(effort.size)
    answer = computed_torque(
        position,
        velocity,
        acceleration,
        noise,
        position_rad,
        velocity_rad_s,
        state,
        limits,
        gains,
        inertia,
        bias,
        torque,
    )
    if not efforts(torque, added, velocity_rad_s, state[MEAN], joints, unknown, effort, level):
        answer |= NOT_FINITE
    return answer


@compiled_as(boolean(WRITE_2D, int64))
def _factorise(square: Array, size: int) -> bool:
    """Cholesky's factor of the first ``size`` rows of a symmetric matrix, of which the lower triangle is given.

    It takes the matrix's place, with the inverse on its diagonal. False where there is none.
    """
    for r in range(size):
        for c in range(r + 1):
            left = square[r, c]
            for k in range(c):
                left -= square[r, k] * square[c, k]
            if c < r:
                square[r, c] = left * square[c, c]
            elif left > 0.0:
                square[r, r] = 1.0 / math.sqrt(left)
            else:
                return False
    return True


@compiled_as(NONE(READ_2D, WRITE, int64))
def _solve(factor: Array, side: Array, size: int) -> None:
    """Turn the first ``size`` numbers of ``side`` b into A^-1 b by the ``factor`` of A."""
    for r in range(size):
        value = side[r]
        for k in range(r):
            value -= factor[r, k] * side[k]
        side[r] = value * factor[r, r]
    for r in range(size - 1, -1, -1):
        value = side[r]
        for k in range(r + 1, size):
            value -= factor[k, r] * side[k]
        side[r] = value * factor[r, r]


@compiled_as(boolean(READ_2D, READ, READ, READ, READ, float64, WRITE))
def held(  # noqa: PLR0912, PLR0917
    factor: Array, diagonal: Array, speed: Array, load: Array, level: Array, period: float, friction: Array
) -> bool:
    """Coulomb's ``friction`` in a step, at most ``level`` at every joint; False where none was found.

        A (v' - v) = T (load + friction),   where v'_i = 0,  or  friction_i = -level_i sign(v'_i)

    A joint rests, or its friction is at its level against its speed. ``factor`` is that of A, whose ``diagonal`` is
    given too, ``speed`` v. By block principal pivoting (J. J. Judice, F. M. Pires, Computers Oper. Res. 21(5), 1994):
    what contradicts itself changes sides, all at once while that helps, then the first only, which ends for every
    positive definite A.
    """
    n = friction.size
    side, known = np.zeros(n, np.int64), np.zeros(n, np.int64)
    columns, square = np.empty((n, n)), np.empty((n, n))
    after, rest = np.empty(n), np.empty(n)
    for i in range(n):  # a first guess: each joint alone
        free = speed[i] * diagonal[i] + period * load[i]
        if abs(free) > period * level[i]:
            side[i] = -1 if free > 0.0 else 1
    most, patience = n + 1, 3
    for _ in range(MOST_PIVOTS):
        resting = 0
        for i in range(n):
            friction[i] = side[i] * level[i]
            after[i] = period * (load[i] + friction[i])
        _solve(factor, after, n)
        for i in range(n):
            after[i] += speed[i]
        for i in range(n):
            if side[i] != 0:
                continue
            if not known[i]:
                columns[i] = 0.0
                columns[i, i] = period
                _solve(factor, columns[i], n)
                known[i] = 1
            rest[resting] = -after[i]
            c = 0
            for j in range(i + 1):
                if side[j] == 0:
                    square[resting, c] = columns[i, j]
                    c += 1
            resting += 1
        if not _factorise(square, resting):
            return False
        _solve(square, rest, resting)
        r, wrong = 0, 0
        for i in range(n):
            if side[i] == 0:
                friction[i] = rest[r]
                r += 1
                wrong += abs(friction[i]) > level[i]
                for j in range(n):
                    after[j] += columns[i, j] * friction[i]
        for i in range(n):
            wrong += side[i] * after[i] > 0.0
        if wrong == 0:
            return True
        patience = 3 if wrong < most else patience - 1
        most = min(most, wrong)
        for i in range(n):
            if side[i] == 0 and abs(friction[i]) > level[i]:
                side[i] = 1 if friction[i] > 0.0 else -1
            elif side[i] * after[i] > 0.0:
                side[i] = 0
            else:
                continue
            if patience < 0:
                break
    return False


@compiled_as(boolean(READ_2D, READ, READ, READ, READ, float64, WRITE, WRITE))
def accelerations(  # noqa: PLR0917
    inertia: Array,
    viscous: Array,
    speed: Array,
    load: Array,
    level: Array,
    period: float,
    friction: Array,
    change: Array,
) -> bool:
    """Coulomb's ``friction`` (``held``) and the joints' ``change`` of speed under it, per second; False where none is.

    ``load`` is all that moves the joints but dry friction; ``viscous`` enters implicitly, as DART steps.
    """
    n = friction.size
    factor, diagonal = np.empty((n, n)), np.empty(n)
    for i in range(n):
        for j in range(i):
            factor[i, j] = inertia[i, j]
        factor[i, i] = diagonal[i] = inertia[i, i] + period * viscous[i]
    if not _factorise(factor, n) or not held(factor, diagonal, speed, load, level, period, friction):
        return False
    for i in range(n):
        change[i] = load[i] + friction[i]
    _solve(factor, change, n)
    return True


@compiled_as(NONE(READ, READ, READ_2D, READ_2D, float64, WRITE_2D, WRITE, WRITE_2D, WRITE_2D, WRITE_2D))
def move_chain(  # noqa: PLR0912, PLR0915, PLR0917
    position_rad: Array,
    velocity_rad_s: Array,
    links: Array,
    marks: Array,
    gravity: float,
    inertia: Array,
    bias: Array,
    screws: Array,
    points: Array,
    mark_speeds: Array,
) -> None:
    """Where the arm is and what moves it: ``inertia`` H (n, n), ``bias`` C q' + g (n,), and its places in the world.

    By products of exponentials, composite bodies and Newton and Euler, all in the world and about its origin, where a
    joint's motion is the screw (a, o x a) of its axis a through o (R. Featherstone, Rigid Body Dynamics Algorithms,
    2008, chapters 5 and 6). ``screws`` (n, 6); ``marks`` are points of the last link in the posture of zeros, and
    ``points`` the joints' origins and after them the marks, which move with ``mark_speeds``.
    """
    n = position_rad.size
    turn, last, shift = np.eye(3), np.eye(3), np.zeros(3)
    bodies, loads = np.empty((n, 10)), np.empty((n, 6))  # mass, m c, J about the origin; torque and force
    w, u, dw, du = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    du[2] = gravity
    turned = np.empty(3)
    for i in range(n):
        link = links[i]
        x, y, z = link[AXIS], link[AXIS + 1], link[AXIS + 2]
        cosine, sine = math.cos(position_rad[i]), math.sin(position_rad[i])
        for r in range(3):  # Rodrigues' turn about the axis, after the turn so far
            p, q, s = turn[r, 0], turn[r, 1], turn[r, 2]
            along = p * x + q * y + s * z
            screws[i, r] = along
            points[i, r] = p * link[ORIGIN] + q * link[ORIGIN + 1] + s * link[ORIGIN + 2] + shift[r]
            last[r, 0], last[r, 1], last[r, 2] = p, q, s
            turn[r, 0], turn[r, 1], turn[r, 2] = rotated_row((p, q, s), (x, y, z), cosine, sine)
            for k in range(3):
                shift[r] += (last[r, k] - turn[r, k]) * link[ORIGIN + k]
        a0, a1, a2 = screws[i, 0], screws[i, 1], screws[i, 2]
        o0, o1, o2 = points[i]
        b0, b1, b2 = o1 * a2 - o2 * a1, o2 * a0 - o0 * a2, o0 * a1 - o1 * a0
        screws[i, 3], screws[i, 4], screws[i, 5] = b0, b1, b2
        rate = velocity_rad_s[i]
        # what the motion so far makes of the screw, times the rate, then the motion of this link
        du[0] += (w[1] * b2 - w[2] * b1 + u[1] * a2 - u[2] * a1) * rate
        du[1] += (w[2] * b0 - w[0] * b2 + u[2] * a0 - u[0] * a2) * rate
        du[2] += (w[0] * b1 - w[1] * b0 + u[0] * a1 - u[1] * a0) * rate
        dw[0] += (w[1] * a2 - w[2] * a1) * rate
        dw[1] += (w[2] * a0 - w[0] * a2) * rate
        dw[2] += (w[0] * a1 - w[1] * a0) * rate
        for r in range(3):
            w[r] += screws[i, r] * rate
            u[r] += screws[i, 3 + r] * rate
        mass = link[MASS]
        for r in range(3):
            turned[r] = shift[r]
            for k in range(3):
                turned[r] += turn[r, k] * link[CENTER + k]
        c0, c1, c2 = turned
        h0, h1, h2 = mass * c0, mass * c1, mass * c2
        body = bodies[i]
        body[0], body[1], body[2], body[3] = mass, h0, h1, h2
        at = 4
        for r in range(3):
            for k in range(3):
                last[r, k] = 0.0
                for m in range(3):
                    last[r, k] += turn[r, m] * link[INERTIA + 3 * m + k]
        for r in range(3):
            for k in range(r + 1):
                body[at] = last[r, 0] * turn[k, 0] + last[r, 1] * turn[k, 1] + last[r, 2] * turn[k, 2]
                body[at] -= mass * turned[r] * turned[k]
                if r == k:
                    body[at] += h0 * c0 + h1 * c1 + h2 * c2
                at += 1
        xx, xy, yy, xz, yz, zz = body[4], body[5], body[6], body[7], body[8], body[9]
        l0 = xx * w[0] + xy * w[1] + xz * w[2] + h1 * u[2] - h2 * u[1]
        l1 = xy * w[0] + yy * w[1] + yz * w[2] + h2 * u[0] - h0 * u[2]
        l2 = xz * w[0] + yz * w[1] + zz * w[2] + h0 * u[1] - h1 * u[0]
        p0 = mass * u[0] + w[1] * h2 - w[2] * h1
        p1 = mass * u[1] + w[2] * h0 - w[0] * h2
        p2 = mass * u[2] + w[0] * h1 - w[1] * h0
        load = loads[i]
        load[0] = xx * dw[0] + xy * dw[1] + xz * dw[2] + h1 * du[2] - h2 * du[1]
        load[1] = xy * dw[0] + yy * dw[1] + yz * dw[2] + h2 * du[0] - h0 * du[2]
        load[2] = xz * dw[0] + yz * dw[1] + zz * dw[2] + h0 * du[1] - h1 * du[0]
        load[0] += w[1] * l2 - w[2] * l1 + u[1] * p2 - u[2] * p1
        load[1] += w[2] * l0 - w[0] * l2 + u[2] * p0 - u[0] * p2
        load[2] += w[0] * l1 - w[1] * l0 + u[0] * p1 - u[1] * p0
        load[3] = mass * du[0] + dw[1] * h2 - dw[2] * h1 + w[1] * p2 - w[2] * p1
        load[4] = mass * du[1] + dw[2] * h0 - dw[0] * h2 + w[2] * p0 - w[0] * p2
        load[5] = mass * du[2] + dw[0] * h1 - dw[1] * h0 + w[0] * p1 - w[1] * p0
    for mark in range(marks.shape[0]):
        for r in range(3):
            points[n + mark, r] = shift[r]
            for k in range(3):
                points[n + mark, r] += turn[r, k] * marks[mark, k]
        x, y, z = points[n + mark]
        mark_speeds[mark, 0] = u[0] + w[1] * z - w[2] * y
        mark_speeds[mark, 1] = u[1] + w[2] * x - w[0] * z
        mark_speeds[mark, 2] = u[2] + w[0] * y - w[1] * x
    for j in range(n - 1, -1, -1):
        if j + 1 < n:
            for k in range(10):
                bodies[j, k] += bodies[j + 1, k]
            for k in range(6):
                loads[j, k] += loads[j + 1, k]
        bias[j] = 0.0
        for k in range(6):
            bias[j] += screws[j, k] * loads[j, k]
        mass, h0, h1, h2, xx, xy, yy, xz, yz, zz = bodies[j]
        a0, a1, a2, b0, b1, b2 = screws[j]
        l0 = xx * a0 + xy * a1 + xz * a2 + h1 * b2 - h2 * b1
        l1 = xy * a0 + yy * a1 + yz * a2 + h2 * b0 - h0 * b2
        l2 = xz * a0 + yz * a1 + zz * a2 + h0 * b1 - h1 * b0
        p0 = mass * b0 + a1 * h2 - a2 * h1
        p1 = mass * b1 + a2 * h0 - a0 * h2
        p2 = mass * b2 + a0 * h1 - a1 * h0
        for i in range(j + 1):
            s = screws[i]
            inertia[i, j] = s[0] * l0 + s[1] * l1 + s[2] * l2 + s[3] * p0 + s[4] * p1 + s[5] * p2
            inertia[j, i] = inertia[i, j]
        inertia[j, j] += links[j, ROTOR]


@compiled_as(NONE(READ_2D, READ, READ, READ, WRITE))
def carry_rotors(screws: Array, velocity_rad_s: Array, change: Array, rotor: Array, force: Array) -> None:
    """Add to ``force`` (n,) what keeps DART's links, which carry their ``rotor``, to the law of geared ones.

        force_j += a_j . sum_{i >= j} m_i - J_j q_j'',   m_i = J_i (a_i (a_i . dw_i) + (a_i . w_i) w_i x a_i)

    DART knows no armature: each rotor J_i is in the link that it turns, about the axis a_i, so that impacts meet it,
    but the joints before it feel it too. ``change`` (n,) is q'' as it shall be with J_i on the diagonal alone; w_i and
    dw_i are the link's rate of turn and its change.
    """
    n = force.size
    w, dw, total, moments = np.zeros(3), np.zeros(3), np.zeros(3), np.empty((n, 3))
    for i in range(n):
        a0, a1, a2 = screws[i, 0], screws[i, 1], screws[i, 2]
        c0, c1, c2 = w[1] * a2 - w[2] * a1, w[2] * a0 - w[0] * a2, w[0] * a1 - w[1] * a0
        dw[0] += a0 * change[i] + c0 * velocity_rad_s[i]
        dw[1] += a1 * change[i] + c1 * velocity_rad_s[i]
        dw[2] += a2 * change[i] + c2 * velocity_rad_s[i]
        for r in range(3):
            w[r] += screws[i, r] * velocity_rad_s[i]
        gain = rotor[i] * (a0 * dw[0] + a1 * dw[1] + a2 * dw[2])
        spin = rotor[i] * (a0 * w[0] + a1 * w[1] + a2 * w[2])
        moments[i, 0], moments[i, 1], moments[i, 2] = (
            gain * a0 + spin * c0,
            gain * a1 + spin * c1,
            gain * a2 + spin * c2,
        )
    for j in range(n - 1, -1, -1):
        force[j] -= rotor[j] * change[j]
        for r in range(3):
            total[r] += moments[j, r]
            force[j] += screws[j, r] * total[r]


@compiled_as(float64(READ, READ, READ))
def _distance(point: Array, start: Array, end: Array) -> float:
    """From ``point`` to the segment between ``start`` and ``end``, all (3,)."""
    along = square = 0.0
    for r in range(3):
        along += (point[r] - start[r]) * (end[r] - start[r])
        square += (end[r] - start[r]) ** 2
    share = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    gap = 0.0
    for r in range(3):
        gap += (point[r] - start[r] - share * (end[r] - start[r])) ** 2
    return math.sqrt(gap)


@compiled_as(float64(READ))
def _margin(ball_m_s: Array) -> float:
    """What cannot be crossed within the next step."""
    return NEAR_M + NEAR_S * float(abs(ball_m_s[0]) + abs(ball_m_s[1]) + abs(ball_m_s[2]))


@compiled_as(boolean(READ, READ, READ_2D, READ))
def _is_by_cup(ball_m: Array, ball_m_s: Array, points: Array, radii: Array) -> bool:
    """Whether ball and cup may touch within the next step."""
    cup = radii.size - 1
    return bool(_distance(ball_m, points[cup], points[cup]) < radii[cup] + _margin(ball_m_s))


@compiled_as(boolean(READ, READ, READ, READ, READ_2D, READ, READ_2D))
def _is_near(  # noqa: PLR0917
    position_rad: Array,
    velocity_rad_s: Array,
    ball_m: Array,
    ball_m_s: Array,
    points: Array,
    radii: Array,
    limits: Array,
) -> bool:
    """Whether ball and arm may touch within the next step, or a joint come to a stop or its top speed.

    ``radii`` are those of the capsules between one of the ``points`` of the arm and the next, and last of the ball that
    holds the cup about the last point; the ball's own is in each. Negative: there is no such part.
    """
    for i in range(position_rad.size):
        q, v = position_rad[i], velocity_rad_s[i]
        if (
            not limits[LOWER, i] + NEAR_RAD < q < limits[UPPER, i] - NEAR_RAD
            or abs(v) > NEAR_SPEED * limits[FASTEST, i]
        ):
            return True
    if _is_by_cup(ball_m, ball_m_s, points, radii):
        return True
    margin = _margin(ball_m_s)
    for i in range(radii.size - 1):
        if radii[i] >= 0.0 and _distance(ball_m, points[i], points[i + 1]) < radii[i] + margin:
            return True
    return False


@compiled_as(
    int64(
        READ, READ, READ, READ, READ, READ, READ, READ, READ, READ_2D, READ_2D, READ, READ, READ_2D, READ, READ_2D,
        READ_2D, float64, float64, WRITE,
    )
)  # fmt: skip
def joint_forces(  # noqa: PLR0917
    position_rad: Array,
    velocity_rad_s: Array,
    effort: Array,
    level: Array,
    ball_m: Array,
    ball_m_s: Array,
    reaction_n: Array,
    pivot_m: Array,
    touch_n: Array,
    screws: Array,
    inertia: Array,
    rotor: Array,
    bias: Array,
    points: Array,
    radii: Array,
    joints: Array,
    limits: Array,
    factor: float,
    period: float,
    force: Array,
) -> int:
    """The ``force`` on the joints in the coming step: of the motors, of dry friction, and the rope's.

        (H + T B) (v' - v) = T (effort + friction + J^T F + J^T D - C v - g - B v)

    as DART steps, with the viscous friction B implicit; F = ``reaction_n`` pulls at ``pivot_m``, and the friction is
    that with which v' obeys Coulomb's law (``held``). D = ``touch_n`` is how the ball has pressed on the cup so far: it
    is in no ``force``, because DART finds it anew, but a joint rests under it. H has the ``rotor`` on its diagonal, and
    ``force`` what ``carry_rotors`` adds for DART. ``factor`` is that on all friction, ``period`` T. The answer is FINE,
    or NEAR where something may touch in that step (see _is_near), or LOST where the inertia has no factor, or no
    friction was found.
    """
    n = effort.size
    load, viscous, friction, change = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    # beside the cup the ball presses on a link, which the joints behind do not feel
    pressed = 1.0 if _is_by_cup(ball_m, ball_m_s, points, radii) else 0.0
    for i in range(n):
        viscous[i] = factor * joints[VISCOUS, i]
        pulled = reaction_n[0] * (screws[i, 1] * pivot_m[2] - screws[i, 2] * pivot_m[1] + screws[i, 3])
        pulled += reaction_n[1] * (screws[i, 2] * pivot_m[0] - screws[i, 0] * pivot_m[2] + screws[i, 4])
        pulled += reaction_n[2] * (screws[i, 0] * pivot_m[1] - screws[i, 1] * pivot_m[0] + screws[i, 5])
        force[i] = effort[i] + pulled
        load[i] = force[i] - bias[i] - viscous[i] * velocity_rad_s[i]
        load[i] += pressed * touch_n[0] * (screws[i, 1] * ball_m[2] - screws[i, 2] * ball_m[1] + screws[i, 3])
        load[i] += pressed * touch_n[1] * (screws[i, 2] * ball_m[0] - screws[i, 0] * ball_m[2] + screws[i, 4])
        load[i] += pressed * touch_n[2] * (screws[i, 0] * ball_m[1] - screws[i, 1] * ball_m[0] + screws[i, 5])
    if not accelerations(inertia, viscous, velocity_rad_s, load, level, period, friction, change):
        return LOST
    for i in range(n):
        force[i] += friction[i]
    carry_rotors(screws, velocity_rad_s, change, rotor, force)
    return NEAR if _is_near(position_rad, velocity_rad_s, ball_m, ball_m_s, points, radii, limits) else FINE


def rope_constants(law: RopeLaw) -> list[float]:
    """Return those of the rope and the cup that it goes round, as ``pull`` takes them before the air's.

    With a tie on the wall its height follows after the rest (ON_WALL).
    """
    cup = law.cup
    sizes = [cup.radius_m, cup.floor_m, cup.rim_m, cup.handle_m, *cup.used_m]
    return [law.length_m, law.stiffness_n_m, law.damping_n_s_m, *sizes]


@compiled_as(NONE(READ, float64, float64, WRITE))
def air(ball_m_s: Array, k1: float, k2: float, force: Array) -> None:
    """Put the drag on the ball into ``force`` (3,)."""
    force[0], force[1], force[2] = drag_n(k1, k2, (ball_m_s[0], ball_m_s[1], ball_m_s[2]))


@compiled
def _between(end: Array, first: int, start: Array) -> tuple[float, float, float]:
    """Return the numbers of ``end`` from ``first`` on less those of ``start`` (3,)."""
    return end[first] - start[0], end[first + 1] - start[1], end[first + 2] - start[2]


@compiled
def _over(way: tuple[float, float, float], length: float) -> tuple[float, float, float]:
    return way[0] / length, way[1] / length, way[2] / length


@compiled
def _toward_knot(up: Array, tie: Array, axis: tuple[float, float, float], rope: Array) -> tuple[float, float, float]:
    """Return the direction across the axis to a tie on the wall, or its rate; see ``pull`` for ``up``."""
    x, y, z = _between(up, 3, tie)
    knot = rope[ON_WALL]
    return _over((x - knot * axis[0], y - knot * axis[1], z - knot * axis[2]), rope[3])


@compiled_as(boolean(READ, READ, READ, READ, READ, READ, READ, WRITE, WRITE))
def pull(  # noqa: PLR0917 - plain numbers and arrays, as compiled code takes them
    ball_m: Array,
    ball_m_s: Array,
    tie_m: Array,
    tie_m_s: Array,
    up_m: Array,
    up_m_s: Array,
    rope: Array,
    pulled: Array,
    force: Array,
) -> bool:
    """Put the rope's pull (physics.rope.rope_pull) into ``pulled`` and its sum with the drag into ``force`` (3,).

    ``up_m`` and ``up_m_s`` (3,) are place and velocity of a point of the cup on its axis, over the tie; ``rope`` holds
    the ``rope_constants``, the drag k1, k2 and the height of that point. With a tie on the wall ``rope`` has its height
    too, ``tie_m`` is the place under it on the axis, and ``up_m`` and ``up_m_s`` (6,) go on with those of the tie.
    False where the ball has gone far away.
    """
    is_on_wall = rope.size > ON_WALL
    used = rope[7], rope[8], rope[9]
    cup = CupProfile(rope[3], rope[4], rope[5], rope[6], used, rope[ON_WALL] if is_on_wall else 0.0)
    axis, axis_rate = _over(_between(up_m, 0, tie_m), rope[HEIGHT]), _over(_between(up_m_s, 0, tie_m_s), rope[HEIGHT])
    side, side_rate = (pulled[SIDE], pulled[SIDE + 1], pulled[SIDE + 2]), (0.0, 0.0, 0.0)
    if is_on_wall:
        side, side_rate = _toward_knot(up_m, tie_m, axis, rope), _toward_knot(up_m_s, tie_m_s, axis_rate, rope)
    ball, velocity = _between(ball_m, 0, tie_m), _between(ball_m_s, 0, tie_m_s)
    law = RopeLaw(rope[0], rope[1], rope[2], cup)
    found = rope_pull(law, ball, velocity, axis, axis_rate, side, side_rate)
    air(ball_m_s, rope[10], rope[11], force)
    extent, pulled[TENSION] = 0.0, found.tension_n
    for r in range(3):
        pulled[r], pulled[REACTION + r] = found.force_n[r], -found.force_n[r]
        pulled[PIVOT + r], pulled[SIDE + r] = tie_m[r] + found.pivot_m[r], found.side[r]
        force[r] += pulled[r]
        extent += abs(ball_m[r]) + abs(ball_m_s[r])
    return bool(extent < FAR_AWAY)


@compiled_as(NONE(float64, float64, READ_2D, WRITE))
def _depth(out: float, up: float, solid: Array, at: Array) -> None:
    """How deep a point ``out`` from the cup's axis and ``up`` over the tie is in the cup, and the way out, into ``at``.

    ``at`` (3,) are the depth, negative outside, and the normal's parts away from the axis and along it. ``solid``
    (k, 4) are the boxes, least and largest of both, that turned about the axis make the cup; their corners are round.
    """
    at[0] = -1.0
    for k in range(solid.shape[0]):
        x, z = out - 0.5 * (solid[k, 0] + solid[k, 1]), up - 0.5 * (solid[k, 2] + solid[k, 3])
        a = abs(x) - 0.5 * (solid[k, 1] - solid[k, 0]) + ROUNDED_M
        b = abs(z) - 0.5 * (solid[k, 3] - solid[k, 2]) + ROUNDED_M
        if a > 0.0 and b > 0.0:
            far = math.sqrt(a * a + b * b)
            depth, nx, nz = ROUNDED_M - far, a / far, b / far
        elif a > b:
            depth, nx, nz = ROUNDED_M - a, 1.0, 0.0
        else:
            depth, nx, nz = ROUNDED_M - b, 0.0, 1.0
        if depth > at[0]:
            at[0], at[1], at[2] = depth, math.copysign(nx, x), math.copysign(nz, z)


@compiled_as(NONE(READ, READ, READ, WRITE))
def _tensions(  # noqa: PLR0912
    diagonal: Array, beside: Array, wanted: Array, pull: Array
) -> None:
    """The ``pull`` >= 0 of every link with  A pull >= wanted, with equality where it pulls; A is tridiagonal.

    Links that would shorten by themselves do not push. ``beside`` are the terms beside the diagonal of A, which are not
    positive in a chain that is not folded: then links are only ever added to those that pull (R. Chandrasekaran, A
    special case of the complementary pivot problem, Opsearch 7, 1970).
    """
    n = diagonal.size
    pulls = wanted > 0.0
    lower, side = np.empty(n), np.empty(n)
    for _ in range(MOST_ADDED):
        for i in range(n):
            lower[i], side[i] = diagonal[i], wanted[i]
            if i > 0 and pulls[i] and pulls[i - 1]:
                share = beside[i - 1] / lower[i - 1]
                lower[i] -= share * beside[i - 1]
                side[i] -= share * side[i - 1]
        for i in range(n - 1, -1, -1):
            if not pulls[i]:
                pull[i] = 0.0
            elif i + 1 < n and pulls[i + 1]:
                pull[i] = (side[i] - beside[i] * pull[i + 1]) / lower[i]
            else:
                pull[i] = side[i] / lower[i]
        added = False
        for i in range(n):
            if not pulls[i]:
                left = wanted[i]
                if i > 0:
                    left -= beside[i - 1] * pull[i - 1]
                if i + 1 < n:
                    left -= beside[i] * pull[i + 1]
                if left > 0.0:
                    pulls[i] = added = True
        if not added:
            break
    for i in range(n):
        pull[i] = max(pull[i], 0.0)


@compiled_as(boolean(READ, READ, READ, READ, READ, READ, READ, WRITE_2D, READ_2D, WRITE, WRITE, WRITE))
def pull_chain(  # noqa: PLR0912, PLR0915, PLR0917
    ball_m: Array,
    ball_m_s: Array,
    tie_m: Array,
    tie_m_s: Array,
    up_m: Array,
    up_m_s: Array,
    rope: Array,
    nodes: Array,
    solid: Array,
    chain: Array,
    pulled: Array,
    force: Array,
) -> bool:
    """``pull``, or where there are ``nodes`` (n + 1, 8) that of a chain with mass, which moves on by a step.

    The nodes are point masses, the first at the tie and the last the ball's centre; columns are NODE, NODE_SPEED, the
    mass, and the length of the link from the node before. Links do not push; the last one is the rope's spring and
    damper, the others hardly stretch. The links' forces f at the end of a sub-step of h seconds solve

        (f_i - k_i e_i) / (k_i h + c_i) = u_i - h sum_j B_ij f_j   where f_i > 0

    with e_i how far a link is stretched, u_i how fast it would grow without the links' forces, and B tridiagonal, by
    the nodes' masses and by how far the cup's surface, stiff and without friction, lets them move. The cup goes on as
    it accelerated in the last step, where it is not carried. ``chain`` holds CHAIN_STEPS and the other numbers of the
    chain, and what it remembers. Forces are means over the step, that on the ball so that DART moves it to where it has
    come here. False where the ball has gone far away.
    """
    near = pull(ball_m, ball_m_s, tie_m, tie_m_s, up_m, up_m_s, rope, pulled, force)
    if not near or nodes.shape[0] == 0:
        return near
    stiffness_n_m, damping_n_s_m, k1, k2, high = rope[1], rope[2], rope[10], rope[11], rope[HEIGHT]
    n, steps, period = nodes.shape[0] - 1, int(chain[CHAIN_STEPS]), chain[CHAIN_PERIOD]
    h, gravity = period / steps, chain[CHAIN_GRAVITY]
    stretched = pulled[TENSION] > 0.0
    air(ball_m_s, k1, k2, force)
    speed, axis, axis_rate, mean_n = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    begun = chain[CHAIN_BEGUN] > 0.0
    for r in range(3):
        speed[r], over = tie_m_s[r], up_m_s[r]
        if begun and chain[CHAIN_CARRIED] == 0.0:  # DART moves bodies by the speeds of the step's end
            speed[r] += tie_m_s[r] - chain[CHAIN_TIE + r]
            over += up_m_s[r] - chain[CHAIN_OVER + r]
        chain[CHAIN_TIE + r], chain[CHAIN_OVER + r] = tie_m_s[r], up_m_s[r]
        axis[r], axis_rate[r] = (up_m[r] - tie_m[r]) / high, (over - speed[r]) / high
        nodes[0, NODE + r], nodes[0, NODE_SPEED + r] = tie_m[r], speed[r]
        nodes[n, NODE + r] = ball_m[r]
        # what else than rope, air and weight has changed the ball's speed since, as a contact does
        nodes[n, NODE_SPEED + r] = (
            nodes[n, NODE_SPEED + r] + ball_m_s[r] - chain[CHAIN_BALL + r] if begun else ball_m_s[r]
        )
        mean_n[r] = pulled[REACTION + r] = 0.0
    chain[CHAIN_BEGUN] = 1.0
    free, normal, held, along = np.empty((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros(n + 1), np.zeros((n + 1, 3))
    diagonal, beside, wanted, pull_n = np.empty(n), np.zeros(n), np.empty(n), np.zeros(n)
    at, moment, way = np.empty(3), np.zeros(3), np.empty(3)
    reach = 0.0
    for k in range(solid.shape[0]):
        reach = max(reach, solid[k, 1], solid[k, 3])
    for r in range(3):
        free[0, r] = speed[r]
    stiff = CONTACT_N_M * h * (h + CONTACT_S)
    for _ in range(steps):
        for i in range(1, n + 1):
            mass = nodes[i, NODE_KG]
            held[i] = 0.0
            for r in range(3):
                free[i, r] = nodes[i, NODE_SPEED + r]
            free[i, 2] -= h * gravity
            if i == n:
                for r in range(3):
                    free[i, r] += h * force[r] / mass
                break
            up = gap = 0.0
            for r in range(3):
                way[r] = nodes[i, NODE + r] - nodes[0, NODE + r]
                up += way[r] * axis[r]
                gap += way[r] * way[r]
            if gap > 4.0 * reach * reach or not -ROUNDED_M < up < reach + ROUNDED_M:
                continue
            out = math.sqrt(max(gap - up * up, 0.0))
            _depth(out, up, solid, at)
            if at[0] <= 0.0:
                continue
            turned = 0.0
            for r in range(3):
                aside = (way[r] - up * axis[r]) / out if out > 1e-9 else 0.0
                normal[i, r] = at[1] * aside + at[2] * axis[r]
                turned += way[r] * axis_rate[r]
            coming = leaving = 0.0
            for r in range(3):
                leaving += normal[i, r] * (speed[r] + up * axis_rate[r] - turned * axis[r])
                coming += normal[i, r] * free[i, r]
            held[i] = stiff / (mass + stiff)
            pushed = (h * CONTACT_N_M * at[0] + stiff * leaving) / (mass + stiff) - held[i] * coming
            for r in range(3):
                free[i, r] += pushed * normal[i, r]
                pulled[REACTION + r] -= mass * pushed * normal[i, r] / period
            moment[0] -= mass * pushed / period * (way[1] * normal[i, 2] - way[2] * normal[i, 1])
            moment[1] -= mass * pushed / period * (way[2] * normal[i, 0] - way[0] * normal[i, 2])
            moment[2] -= mass * pushed / period * (way[0] * normal[i, 1] - way[1] * normal[i, 0])
        for i in range(1, n + 1):
            size = 0.0
            for r in range(3):
                along[i, r] = nodes[i, NODE + r] - nodes[i - 1, NODE + r]
                size += along[i, r] * along[i, r]
            size = math.sqrt(size)
            growth = 0.0
            for r in range(3):
                along[i, r] /= max(size, 1e-9)
                growth += along[i, r] * (free[i, r] - free[i - 1, r])
            spring, damper = (stiffness_n_m, damping_n_s_m) if i == n else (LINK_N_M, LINK_N_M * LINK_S)
            ease = 1.0 / (spring * h + damper)
            wanted[i - 1] = growth + spring * ease * (size - nodes[i, NODE_M])
            diagonal[i - 1] = ease
        for i in range(1, n + 1):  # what node i adds: to its own link and the next
            mass = nodes[i, NODE_KG]
            own = nxt = both = 0.0
            for r in range(3):
                own += along[i, r] * normal[i, r]
                if i < n:
                    nxt += along[i + 1, r] * normal[i, r]
                    both += along[i, r] * along[i + 1, r]
            diagonal[i - 1] += h * (1.0 - held[i] * own * own) / mass
            if i < n:
                diagonal[i] += h * (1.0 - held[i] * nxt * nxt) / mass
                beside[i - 1] = -h * (both - held[i] * own * nxt) / mass
        _tensions(diagonal, beside, wanted, pull_n)
        for i in range(1, n + 1):
            mass, across = nodes[i, NODE_KG], 0.0
            for r in range(3):
                way[r] = -pull_n[i - 1] * along[i, r] + (pull_n[i] * along[i + 1, r] if i < n else 0.0)
                across += way[r] * normal[i, r]
            across *= held[i]
            for r in range(3):
                pushed = across * normal[i, r]
                nodes[i, NODE_SPEED + r] = free[i, r] + h / mass * (way[r] - pushed)
                way[r] = nodes[i, NODE + r] - nodes[0, NODE + r]
                nodes[i, NODE + r] += h * nodes[i, NODE_SPEED + r]
            if across != 0.0:  # the cup holds so much of the links' forces
                share = across * h / period
                for r in range(3):
                    pulled[REACTION + r] += share * normal[i, r]
                moment[0] += share * (way[1] * normal[i, 2] - way[2] * normal[i, 1])
                moment[1] += share * (way[2] * normal[i, 0] - way[0] * normal[i, 2])
                moment[2] += share * (way[0] * normal[i, 1] - way[1] * normal[i, 0])
        for r in range(3):
            mean_n[r] -= pull_n[n - 1] * along[n, r] * h / period
            pulled[REACTION + r] += pull_n[0] * along[1, r] * h / period
            nodes[0, NODE + r] += h * speed[r]
            axis[r] += h * axis_rate[r]
    size = square = 0.0
    for r in range(3):
        size += mean_n[r] * mean_n[r]
        square += pulled[REACTION + r] * pulled[REACTION + r]
        # the force with which DART moves the ball to where it has come here
        chain[CHAIN_BALL + r] = (nodes[n, NODE + r] - ball_m[r]) / period
        given = nodes[n, NODE_KG] * ((chain[CHAIN_BALL + r] - ball_m_s[r]) / period + (gravity if r == 2 else 0.0))
        pulled[r], force[r] = given - force[r], given
    # a loose end tugs at the ball too
    pulled[TENSION] = math.sqrt(size) if stretched and size > chain[CHAIN_SLACK] * chain[CHAIN_SLACK] else 0.0
    way[0] = pulled[REACTION + 1] * moment[2] - pulled[REACTION + 2] * moment[1]
    way[1] = pulled[REACTION + 2] * moment[0] - pulled[REACTION] * moment[2]
    way[2] = pulled[REACTION] * moment[1] - pulled[REACTION + 1] * moment[0]
    far = math.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
    share = 0.0 if square < 1e-12 else 1.0 / max(square, far / (2.0 * reach))
    for r in range(3):
        pulled[PIVOT + r] = tie_m[r] + share * way[r]
    return True


@compiled_as(
    int64(
        READ, READ, READ, READ, READ, READ, READ, READ, READ, READ, READ_2D, READ_2D, READ_2D, READ_2D, READ, READ,
        READ, READ, WRITE_2D, WRITE, WRITE, WRITE, WRITE, WRITE, WRITE_2D, READ_2D, WRITE,
    )
)  # fmt: skip
def step_forces(  # noqa: PLR0917
    position: Array,
    velocity: Array,
    acceleration: Array,
    noise: Array,
    added: Array,
    position_rad: Array,
    velocity_rad_s: Array,
    ball_m: Array,
    ball_m_s: Array,
    touch_n: Array,
    links: Array,
    marks: Array,
    limits: Array,
    joints: Array,
    radii: Array,
    rope: Array,
    gains: Array,
    unknown: Array,
    state: Array,
    effort: Array,
    level: Array,
    pulled: Array,
    ball_force: Array,
    force: Array,
    nodes: Array,
    solid: Array,
    chain: Array,
) -> int:
    """All forces of a step of an arm with a ball: ``move_chain``, ``pull_chain``, ``command``, ``joint_forces`` in one.

    ``gains`` are Kp, Kd, the period and gravity. GONE where the ball has gone far away; nothing is done after that, nor
    after NOT_FINITE.
    """
    n = position_rad.size
    inertia, bias, screws = np.empty((n, n)), np.empty(n), np.empty((n, 6))
    points, speeds = np.empty((n + marks.shape[0], 3)), np.empty((marks.shape[0], 3))
    move_chain(position_rad, velocity_rad_s, links, marks, gains[3], inertia, bias, screws, points, speeds)
    tie, tie_speed = points[n + TIE], speeds[TIE]
    # after the point on the axis, a tie on the wall
    over, over_speed = points[n + OVER :].copy().reshape(-1), speeds[OVER:].copy().reshape(-1)
    for r in range(3):
        over[r] = tie[r] + rope[HEIGHT] * (over[r] - tie[r])
        over_speed[r] = tie_speed[r] + rope[HEIGHT] * (over_speed[r] - tie_speed[r])
    if not pull_chain(
        ball_m, ball_m_s, tie, tie_speed, over, over_speed, rope, nodes, solid, chain, pulled, ball_force
    ):
        return GONE
    answer = command(
        position, velocity, acceleration, noise, added, position_rad, velocity_rad_s, state, limits, gains[:3], joints,
        unknown, inertia, bias, effort, level,
    )  # fmt: skip
    if answer & NOT_FINITE:
        return answer
    return answer | joint_forces(
        position_rad, velocity_rad_s, effort, level, ball_m, ball_m_s, pulled[REACTION:PIVOT], pulled[PIVOT:SIDE],
        touch_n, screws, inertia, links[:, ROTOR], bias, points[: n + TIE], radii, joints, limits, unknown[0], gains[2],
        force,
    )  # fmt: skip
