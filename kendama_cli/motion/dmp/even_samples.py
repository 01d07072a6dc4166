"""Sums over many even samples, s_i = i / (n - 1), of functions that are known at fewer even nodes.

A function's value at a sample is six numbers of the nodes about it times six weights (``response_columns``). So
sum_i p_i q(s_i) takes the samples together cell by cell, once for all functions. What functions make with each other
is smooth, and their sum is that of Euler and Maclaurin (M. Abramowitz, I. Stegun, "Handbook of mathematical
functions", 1964, 23.1.30), which no sample enters:

    sum_i f(s_i) = (n - 1) int f + (f(0) + f(1)) / 2 + h (f'(1) - f'(0)) / 12 - h^3 (f'''(1) - f'''(0)) / 720 ...

with h = 1 / (n - 1), f = q_j q_k, taken as far as h^5.

The functions are those of which a primitive's positions are made, T' columns(s), orthonormal over the motion: normal
equations of q lose nothing, where those of the columns would lose half of the digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from kendama_cli.motion.dmp.response_columns import ResponseColumns, cell_rows, quintic, read_rows
from kendama_cli.schema.arrays import Array

_POINTS, _SHARES = 0.5 * np.array(np.polynomial.legendre.leggauss(6)) + np.array([[0.5], [0.0]])
"""Gauss's points and fractions of a cell: exact for products of quintics."""


@dataclass(frozen=True)
class GramSeries:
    """The terms of the sums of products of p functions of each of W bases; each (W, p, p)."""

    integral: Array
    values: Array
    first: Array
    third: Array
    fifth: Array

    def at(self, count: int) -> Array:
        """Return sum_i q_j q_k over ``count`` even samples; (W, p, p)."""
        h = 1.0 / (count - 1)
        edges = self.values / 2 + h / 12 * self.first - h**3 / 720 * self.third + h**5 / 30240 * self.fifth
        return self.integral / h + edges


def gram_series(rows: Array, ends: Array) -> GramSeries:
    """Return the series of the nodes' ``rows`` (W, 3 (n + 1), p), and of value and five derivatives at 0 and 1:
    ``ends``
    (6, W, 2, p).
    """

    def change(a: int, b: int) -> Array:
        """Return the change of the products of derivatives a and b from 0 to 1, in both orders."""
        made = ends[a].transpose(0, 2, 1) @ (ends[b] * np.array([-1.0, 1.0])[:, None])
        return np.asarray(made + made.transpose(0, 2, 1))

    six = cell_rows(rows)
    cells = six.shape[1]
    points = np.sqrt(_SHARES) * quintic(_POINTS)
    inner = np.tensordot(points, six, (0, 3)).transpose(1, 0, 2, 3).reshape(len(rows), -1, rows.shape[2])
    return GramSeries(
        integral=inner.transpose(0, 2, 1) @ inner / cells,
        values=ends[0].transpose(0, 2, 1) @ ends[0],
        first=change(1, 0),
        third=change(3, 0) + 3 * change(2, 1),
        fifth=change(5, 0) + 5 * change(4, 1) + 10 * change(3, 2),
    )


def node_sums(position: Array, nodes: int) -> Array:
    """Return the projections of ``position`` (r, n), at no fewer than ``nodes`` even samples, on each node's three
    numbers.

    Times the rows (3 nodes, p) of functions it gives sum_i position_i q(s_i); (r, 3 nodes).
    """
    weights, begins = _cells(position.shape[1], nodes - 1)
    cells = np.add.reduceat(position[:, None] * weights, begins, axis=2)
    made = np.zeros((len(position), nodes, 3))
    made[:, :-1] = cells[:, :3].transpose(0, 2, 1)
    made[:, 1:] += cells[:, 3:].transpose(0, 2, 1)
    return made.reshape(len(position), -1)


@lru_cache(maxsize=128)
def _cells(count: int, cells: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the six weights of each of ``count`` samples (6, count), and each cell's first sample (cells,)."""
    position = np.linspace(0.0, cells, count)
    begins = np.searchsorted(position, np.arange(cells))
    cell = np.minimum(position.astype(np.int64), cells - 1)
    return quintic(position - cell), begins


@dataclass(frozen=True)
class CommonFunctions:
    """The p orthonormal functions of each of W bases with given ends."""

    lift: Array
    """(W, p, p): T, from the functions to the free columns"""
    triangle: Array
    """(W, p, p): the inverse of T"""
    rows: Array
    """(W, 3 (n + 1), p): see ``ResponseColumns``"""
    jerk: Array
    """(W, p, p): the integral of the third derivatives' products"""
    miss: Array
    """(W, p, p): the square of the goal's miss, weighted"""
    ends: Array
    """(6, W, 2, p): see ``ResponseColumns``"""

    @cached_property
    def gram(self) -> GramSeries:
        """Return their Gram matrices over many even samples."""
        return gram_series(self.rows, self.ends)

    @property
    def nodes(self) -> int:
        """n + 1."""
        return int(self.rows.shape[1]) // 3

    def at(self, share: Array) -> Array:
        """Return Q at fractions ``share`` (n,), each in [0, 1]; (W, n, p)."""
        return read_rows(self.rows, share)


def common_functions(columns: ResponseColumns, free: Sequence[int], end_weight: float) -> CommonFunctions:
    """Return the functions of the ``free`` columns; a miss of the goal counts as ``end_weight`` times the samples'
    own.
    """
    rows, jerk = columns.rows[:, :, free], columns.jerk[:, :, free]
    miss = end_weight * columns.miss[:, :, free]
    thin = rows[:, ::6]  # the values at every other node
    triangle = np.asarray(np.linalg.qr(np.concatenate((thin / np.sqrt(thin.shape[1]), miss), axis=1), mode="r"))
    lift = np.linalg.inv(triangle)
    bend, off = jerk @ lift, miss @ lift
    return CommonFunctions(
        lift=lift,
        triangle=triangle,
        rows=rows @ lift,
        jerk=bend.transpose(0, 2, 1) @ bend,
        miss=off.transpose(0, 2, 1) @ off,
        ends=columns.ends[..., free] @ lift,
    )
