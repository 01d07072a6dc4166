"""Runge-Kutta integration of the critically damped spring that every movement primitive is.

In the motion's own time s = t / tau, eq. 3 reads y'' + 2 w y' + w^2 y = r(s) with w = sqrt K; for the distance to the
goal, y - g, the drive r is f alone. Critical damping lets it fall into two first-order lags, u = y' + w y:

    u' = -w u + r,    y' = -w y + u                                                      (linear, triangular)

so that a whole Runge-Kutta solution of order 4 is two recurrences of constant gain: a triangular band of equations,
which LAPACK solves from the top down.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dtbtrs

from kendama_cli.schema.arrays import Array

Drive = Callable[[Array], Array]
"""r at instants s (n,): (n, k) for k coordinates."""


@dataclass(frozen=True)
class State:
    """Position, rate and second derivative by s at n instants; every array is (n, k)."""

    position: Array
    rate: Array
    second: Array


@dataclass(frozen=True)
class Solution:
    """Nodes of the solution on s = 0 .. 1, readable at any s between by one further Runge-Kutta step."""

    drive: Drive
    frequency: float
    nodes: Array
    """(steps + 1, 2, k): y and u at s = i / steps."""
    driven: Array
    """(steps + 1, k): r there."""

    def at(self, share: Array) -> State:
        """Return the state at ``share`` (n,) of the motion, each in [0, 1]."""
        steps = len(self.nodes) - 1
        s = np.asarray(share, dtype=np.float64)
        node = np.clip(np.floor(s * steps).astype(np.int64), 0, steps - 1)
        start = node / steps
        h = (s - start)[:, None]
        y_gain, cross, u_gain = _free(h, self.frequency)
        drive = self.drive(s)
        push = _forced(h, self.frequency, self.driven[node], self.drive(start + h[:, 0] / 2), drive)
        y = y_gain * self.nodes[node, 0] + cross * self.nodes[node, 1] + push[0]
        u = u_gain * self.nodes[node, 1] + push[1]
        rate = u - self.frequency * y
        return State(y, rate, drive - 2 * self.frequency * rate - self.frequency**2 * y)


def solve(drive: Drive, start: Array, start_rate: Array, frequency: float, steps: int) -> Solution:
    """Integrate y'' + 2 w y' + w^2 y = r(s) over s = 0 .. 1 with ``steps`` classical Runge-Kutta steps of order 4.

    ``start`` and ``start_rate`` (k,) are y and dy/ds at s = 0; ``frequency`` is w.
    """
    grid = np.arange(steps + 1) / steps
    h = 1.0 / steps
    drives = drive(grid)
    push = _forced(np.array(h), frequency, drives[:-1], drive(grid[:-1] + h / 2), drives[1:])
    y_gain, cross, u_gain = (float(gain) for gain in _free(np.array(h), frequency))
    u = recur(u_gain, push[1], start_rate + frequency * start)
    y = recur(y_gain, push[0] + cross * u[:-1], start)
    return Solution(drive, frequency, np.stack((y, u), axis=1), drives)


def settle(start: Array, start_rate: Array, frequency: float, since: Array) -> State:
    """Return the exact free motion to zero: e = (e0 + (e0' + w e0) s) exp(-w s), s = ``since`` (n,); starts are
    (k,).
    """
    s = np.asarray(since, dtype=np.float64)[:, None]
    slope = start_rate + frequency * start
    fade = np.exp(-frequency * s)
    position = (start + slope * s) * fade
    rate = slope * fade - frequency * position
    return State(position, rate, -2 * frequency * rate - frequency**2 * position)


def recur(gain: float, push: Array, start: Array) -> Array:
    """Return z_{i+1} = gain z_i + push_i from z_0 = ``start`` (k,); (n + 1, k)."""
    right = np.vstack((start, push))
    # unit diagonal, -gain below it; scipy.signal's filter does the same and takes half a second to import
    band = np.array([[1.0], [-gain]]).repeat(len(right), axis=1)
    return np.asarray(dtbtrs(band, right, uplo="L", diag="U")[0])


def _free(h: Array, w: float) -> tuple[Array, Array, Array]:
    """Return one step without drive, sum (hA)^k / k! for k = 0 .. 4 with A = [[-w, 1], [0, -w]]: (y to y, u to y, u
    to u).
    """
    d = -w * h
    gain = 1 + d + d**2 / 2 + d**3 / 6 + d**4 / 24
    return gain, h * (1 + d + d**2 / 2 + d**3 / 6), gain


def _forced(h: Array, w: float, begin: Array, center: Array, end: Array) -> tuple[Array, Array]:
    """Return the effect on y and on u of one step from rest under the drive at its start, centre and end.

    With M = h A / 2: h/6 [(1 + 2M + 2M^2 + 2M^3) b0 + (4 + 4M + 2M^2) b1 + b2], b = (0, r). M^k has d^k on the
    diagonal, d = -w h / 2, and k d^(k-1) h / 2 above it.
    """
    d = -w * h / 2
    to_u = h / 6 * ((1 + 2 * d + 2 * d**2 + 2 * d**3) * begin + (4 + 4 * d + 2 * d**2) * center + end)
    to_y = h / 6 * (h / 2) * ((2 + 4 * d + 6 * d**2) * begin + (4 + 4 * d) * center)
    return to_y, to_u
