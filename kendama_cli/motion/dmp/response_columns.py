"""Responses of eq. 3 to a unit of each free number, at even nodes, for several widths at once.

    y(s) = g + g' (s - 1) + e(s),   e = (y0 - g + g') a(s) + (y0' - g') b(s) + sum_j w_j B_j(s)

a and b are free motions to zero, known exactly. B_j answers the j-th feature r; in the two lags of ``integration``,
u' = -w u + r and y' = -w y + u, over one cell of length h

    u(s + h) = e^-wh u(s) + int_0^h e^-w(h-t) r dt,    y(s + h) = e^-wh (y + h u) + int_0^h (h - t) e^-w(h-t) r dt

with both integrals by Gauss's three points: their error, of order 6, is that of the features alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.motion.dmp.basis import Basis, feature_rates, features, phase
from kendama_cli.motion.dmp.primitive import recur, settle
from kendama_cli.schema.arrays import Array

CELLS_PER_FUNCTION, CELLS_PER_FREQUENCY = 8, 5
"""Gauss and Hermite then leave 2e-8 of a function."""
_POINTS = 0.5 + np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0])
_SHARES = np.array([5.0, 8.0, 5.0]) / 18.0
_STEP = 1e-3
_DIFFERENCES = np.array([[1, -8, 0, 8, -1], np.array([-1, 16, -30, 16, -1]) / _STEP]) / (12 * _STEP)
"""From a function at -2 .. 2 steps to its first and second derivative."""


@dataclass(frozen=True)
class ResponseColumns:
    """Columns of y0, y0', g, g' and the m weights of each of W bases, at n + 1 even nodes of s = 0 .. 1."""

    rows: Array
    """(W, 3 (n + 1), 4 + m): of each node the value, and its first and second derivative over the cells between."""
    jerk: Array
    """(W, n + 1, 4 + m): the third derivatives by s, times the root of the trapezoidal rule's weights."""
    ends: Array
    """(6, W, 2, 4 + m): value and five derivatives by s at 0 and 1"""
    miss: Array
    """(W, 2, 4 + m): how far y(1) is from g, and y'(1) from g', in 1 / w."""


def response_columns(bases: Sequence[Basis]) -> ResponseColumns:
    """Return the columns of ``bases``, which differ in their widths only."""
    first, w = bases[0], bases[0].frequency
    cells = 2 * round(max(CELLS_PER_FUNCTION * first.functions, CELLS_PER_FREQUENCY * w) / 2)
    h, grid = 1.0 / cells, np.arange(cells + 1) / cells
    widths = np.array([basis.widths for basis in bases])
    within = phase((grid[:-1, None] + h * _POINTS), first.decay)
    # (3, cells, W m): products with three shares run over whole arrays
    drive = np.stack([features(x[:, None], first.centers, widths).reshape(cells, -1) for x in within.T])
    left = h * (1.0 - _POINTS)
    fade = h * _SHARES * np.exp(-w * left)
    gain, at_rest = float(np.exp(-w * h)), np.zeros(drive.shape[2])
    u = recur(gain, np.tensordot(fade, drive, 1), at_rest)
    y = recur(gain, np.tensordot(fade * left, drive, 1) + h * gain * u[:-1], at_rest)
    x = phase(grid, first.decay)[:, None]
    r = features(x, first.centers, widths).reshape(cells + 1, -1)
    rate = u - w * y
    second = r - 2 * w * rate - w**2 * y
    rates = feature_rates(x, first.centers, widths, first.decay).reshape(cells + 1, -1)
    third = rates - 2 * w * second - w**2 * rate
    whole = [
        np.concatenate((np.broadcast_to(ends, (len(bases), *ends.shape)), made), axis=2)
        for ends, made in zip(
            _end_columns(grid, w),
            (one.reshape(cells + 1, len(bases), -1).transpose(1, 0, 2) for one in (y, rate, second, third)),
            strict=True,
        )
    ]
    rows = np.stack([state * h**order for order, state in enumerate(whole[:3])], axis=2)
    weights = np.full(cells + 1, h)
    weights[[0, -1]] /= 2.0
    miss = np.stack((whole[0][:, -1], whole[1][:, -1] / w), axis=1)
    miss[:, [0, 1], [2, 3]] -= 1.0, 1.0 / w  # the goal's own columns read g and g' there
    return ResponseColumns(
        rows=rows.reshape(len(bases), -1, rows.shape[3]),
        jerk=whole[3] * np.sqrt(weights)[:, None],
        ends=_at_ends([one[:, [0, -1]] for one in whole], w, _drive_derivatives(first, widths)),
        miss=miss,
    )


def _drive_derivatives(basis: Basis, widths: Array) -> Array:
    """Return r'' and r''' of the features at 0 and 1, for ``widths`` (W, m), by differences of r'; (2, W, 2, m)."""
    instants = np.array([[0.0], [1.0]]) + _STEP * np.arange(-2, 3)
    rates = feature_rates(phase(instants.reshape(-1, 1), basis.decay), basis.centers, widths, basis.decay)
    made = np.tensordot(_DIFFERENCES, rates.reshape(2, 5, *widths.shape), (1, 1))
    return np.asarray(made.transpose(0, 2, 1, 3))


def _at_ends(known: Sequence[Array], w: float, drive: Array) -> Array:
    """Return the ``known`` value and three derivatives (W, 2, 4 + m), and two more from eq. 3 differentiated."""
    made = list(known)
    for push in drive:
        further = -2 * w * made[-1] - w**2 * made[-2]
        further[..., 4:] += push
        made.append(further)
    return np.stack(made)


def _end_columns(share: Array, w: float) -> tuple[Array, Array, Array, Array]:
    """Return the value and three derivatives of the columns of y0, y0', g and g'; each (n, 4)."""
    unit, none = np.ones(1), np.zeros(1)
    position, speed = settle(unit, none, w, share), settle(none, unit, w, share)
    third = [-2 * w * one.second - w**2 * one.rate for one in (position, speed)]
    s = share[:, None]
    return (
        np.hstack(
            (position.position, speed.position, 1 - position.position, s - 1 + position.position - speed.position)
        ),
        np.hstack((position.rate, speed.rate, -position.rate, 1 + position.rate - speed.rate)),
        np.hstack((position.second, speed.second, -position.second, position.second - speed.second)),
        np.hstack((third[0], third[1], -third[0], third[0] - third[1])),
    )


def read_rows(rows: Array, share: Array) -> Array:
    """Return the functions from ``rows`` (W, 3 (n + 1), p) at fractions ``share`` (k,), each in [0, 1]; (W, k, p).

    Quintic Hermite interpolation between the nodes.
    """
    cells = rows.shape[1] // 3 - 1
    position = np.asarray(share) * cells
    cell = np.minimum(position.astype(np.int64), cells - 1)
    weights = quintic(position - cell)
    return np.stack([np.einsum("rk,kpr->kp", weights, one[cell]) for one in cell_rows(rows)])


def cell_rows(rows: Array) -> Array:
    """Return the six rows of each cell, three of its start and three of its end; a view (W, n, p, 6) of (W, 3 (n +
    1), p).
    """
    return np.lib.stride_tricks.sliding_window_view(rows, 6, axis=1)[:, ::3]


def quintic(u: Array) -> Array:
    """Return Hermite's six weights at u = 0 .. 1 (n,) of value, first and second derivative at 0, then at 1; (6, n)."""
    v, square, cube = 1 - u, u * u, u * u * u
    far, left = cube * (10 - 15 * u + 6 * square), v * v * v
    near = (1 - far, u * left * (1 + 3 * u), square * left / 2)
    return np.stack((*near, far, -cube * v * (4 - 3 * u), cube * v * v / 2))
