"""Coulomb's friction in the joints in a step, compiled. Arrays (n,) have one value per joint."""

from __future__ import annotations

import math

import numpy as np

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
    most, patience = n + 1, 3
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
