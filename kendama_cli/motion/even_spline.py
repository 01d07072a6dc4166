"""Cubics of joint motion: a spline that is cheap to read one instant at a time, and the cubic through two states."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.schema.arrays import Array

Numbers = TypeVar("Numbers", float, Array)


@dataclass(frozen=True)
class CurvePoint:
    """A curve's value and its first two derivatives by its parameter, each (n,)."""

    value: Array
    first: Array
    second: Array


class EvenSpline:
    """The natural-end cubic spline through ``values`` (k, n) at ``start + i step``."""

    def __init__(self, start: float, step: float, values: Array) -> None:
        knots = start + step * np.arange(len(values))
        self.start, self.step, self.end = start, step, float(knots[-1])
        pieces = CubicSpline(knots, values, bc_type="not-a-knot").c
        self.coefficients: Array = np.ascontiguousarray(pieces)
        """Those of every piece's cubic (4, k - 1, n), the highest power first."""
        self._pieces = [tuple(pieces[:, i]) for i in range(pieces.shape[1])]

    def at(self, parameter: float) -> CurvePoint:
        """Return the curve at ``parameter``; beyond the ends the last pieces are extended."""
        index, u = piece_at(parameter, self.start, self.step, len(self._pieces))
        a, b, c, d = self._pieces[index]
        return CurvePoint(*cubic(a, b, c, d, u))


def piece_at(parameter: float, start: float, step: float, pieces: int) -> tuple[int, float]:
    """Return which of the even ``pieces`` holds ``parameter``, and how far into it; the end ones go on for ever."""
    index = min(max(int((parameter - start) / step), 0), pieces - 1)
    return index, parameter - start - index * step


def cubic(a: Numbers, b: Numbers, c: Numbers, d: Numbers, u: float) -> tuple[Numbers, Numbers, Numbers]:
    """Return a u^3 + b u^2 + c u + d and its first two derivatives by u: numbers or arrays."""
    return ((a * u + b) * u + c) * u + d, (3 * a * u + 2 * b) * u + c, 6 * a * u + 2 * b


State = tuple[Array, Array]
"""Positions and velocities (n,)."""


def cubic_between(first: State, last: State, *, steps: int, step_s: float) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations (``steps``, n) at the end of every step from ``first`` to
    ``last``.

    q(t) = q0 + t (v0 + t (c + t d)), where c and d are such that q and q' are those of ``last`` after all steps.
    """
    (q0, v0), (q1, v1), total = first, last, steps * step_s
    c = (3 * (q1 - q0) / total - 2 * v0 - v1) / total
    d = (v0 + v1 - 2 * (q1 - q0) / total) / total**2
    t = step_s * np.arange(1, steps + 1)[:, None]
    return q0 + t * (v0 + t * (c + t * d)), v0 + t * (2 * c + 3 * t * d), 2 * c + 6 * t * d
