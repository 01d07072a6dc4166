"""Computed torque, what the motors make of it, and Coulomb friction in a step, compiled. Arrays (n,), one a joint."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.artifacts.friction_model import dry_friction
from kendama_cli.robot_model.friction import direction
from kendama_cli.simulation.dart.drive_kernel import MEAN, POSITION, clipped, follow
from kendama_cli.system.compiled import (
    NONE,
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

COULOMB, STRIBECK, PER_SPEED, VISCOUS, EFFORT = range(5)
"""Rows of the joints' constants (5, n): Fc, Fs, 1 / vs, b, the motors' limits."""
FINE, LIMITED, NOT_FINITE, NEAR, LOST, GONE = 0, 1, 2, 4, 8, 16
"""Answers of a step, the bits of an integer."""


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
    """Compute the ``torque`` that ArmWorld's law commands without friction, by ``inertia`` H and ``bias`` C q' + g.

    ``gains`` are Kp, Kd and the period; errors are those before the drive moves on. A reference that is not finite lets
    the drive brake, and its joint's answer is not finite.
    """
    kp, kd, period = gains
    n = torque.size
    errors, desired = np.empty(n), np.empty(n)
    for i in range(n):
        errors[i] = kd * (state[MEAN, i] - velocity_rad_s[i])
        errors[i] += kp * (state[POSITION, i] - position_rad[i] - noise[i])
    answer = LIMITED if follow(position, velocity, acceleration, state, limits, period, desired) else FINE
    for i in range(n):
        desired[i] += errors[i]
    for i in range(n):
        torque[i] = bias[i]
        for j in range(n):
            torque[i] += inertia[i, j] * desired[j]
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
    """Compute the motors' efforts for ``torque``, and friction's limit; return False if ``torque`` is not finite.

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
            effort[i] = clipped(given, -joints[EFFORT, i], joints[EFFORT, i])
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
    """Compute ``computed_torque`` and what the motors make of it (``efforts``)."""
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


MOST_PIVOTS = 200


@compiled_as(boolean(WRITE_2D, int64))
def _factorise(square: Array, size: int) -> bool:
    """Factorise by Cholesky the first ``size`` rows of a symmetric matrix, given its lower triangle.

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
def solve(factor: Array, side: Array, size: int) -> None:
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
    """Solve for Coulomb's ``friction`` in a step, at most ``level`` at every joint; False if none was found.

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
    maximum, patience = n + 1, 3
    for _ in range(MOST_PIVOTS):
        resting = 0
        for i in range(n):
            friction[i] = side[i] * level[i]
            after[i] = period * (load[i] + friction[i])
        solve(factor, after, n)
        for i in range(n):
            after[i] += speed[i]
        for i in range(n):
            if side[i] != 0:
                continue
            if not known[i]:
                columns[i] = 0.0
                columns[i, i] = period
                solve(factor, columns[i], n)
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
        solve(square, rest, resting)
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
        patience = 3 if wrong < maximum else patience - 1
        maximum = min(maximum, wrong)
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
    """Solve for Coulomb's ``friction`` (``held``) and the joints' ``change`` of velocity per second; False if none.

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
    solve(factor, change, n)
    return True
