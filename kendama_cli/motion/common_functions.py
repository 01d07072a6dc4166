"""The functions that a primitive's positions are made of, orthonormal over the motion, to be read at any share.

What a basis and its ends can draw is one space of functions, whatever the samples. So its columns (``position_fit``)
are made orthonormal once, q(s) = T' columns(s), and read between the nodes of their integration by quintic Hermite
interpolation, which leaves 1e-13 of a function. Over many samples q is nearly orthogonal still: normal equations of q
lose nothing, where those of the columns would lose half of the digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class CommonFunctions:
    """The p orthonormal functions of each of W bases with given ends."""

    lift: Array
    """(W, p, p): T, from the functions to the free columns"""
    triangle: Array
    """(W, p, p): the inverse of T"""
    nodes: Array
    """(W, 3 (cells + 1), p): of each node q, and its first and second derivative over the cells between nodes"""
    jerk: Array
    """(W, p, p): the integral of the third derivatives' products"""
    miss: Array
    """(W, p, p): the square of the goal's miss, weighted"""

    def at(self, share: Array) -> Array:
        """Q at ``share`` (n,), each in [0, 1]; (W, n, p)."""
        cells = self.nodes.shape[1] // 3 - 1
        place = np.asarray(share) * cells
        cell = np.minimum(place.astype(np.int64), cells - 1)
        weights = _quintic(place - cell)
        read = self.nodes[:, 3 * cell] * weights[0][:, None]
        # the six rows of a cell, three of its begin and three of its end, follow each other
        for row in range(1, 6):
            read += self.nodes[:, 3 * cell + row] * weights[row][:, None]
        return np.asarray(read)


def beside(several: Sequence[CommonFunctions]) -> CommonFunctions:
    """Those of several bases as one."""
    return CommonFunctions(
        *(
            np.concatenate([getattr(one, name) for one in several])
            for name in ("lift", "triangle", "nodes", "jerk", "miss")
        )
    )


def common_functions(states: tuple[Array, Array, Array], jerk: Array, miss: Array) -> CommonFunctions:
    """From position, rate and second derivative of the free columns at even nodes (n, p), their jerk and their miss."""
    cells = len(states[0]) - 1
    thin = states[0][::8] / np.sqrt(cells / 8)
    triangle = np.asarray(np.linalg.qr(np.vstack((thin, miss)), mode="r"))
    lift = np.linalg.inv(triangle)
    nodes = np.stack([(state @ lift) / cells**order for order, state in enumerate(states)], axis=1)
    bend, off = jerk @ lift, miss @ lift
    rows = nodes.reshape(1, -1, nodes.shape[2])
    lift, triangle, jerk_squared, missed = (
        np.asarray(one)[None] for one in (lift, triangle, bend.T @ bend, off.T @ off)
    )
    return CommonFunctions(lift, triangle, rows, jerk_squared, missed)


def _quintic(u: Array) -> tuple[Array, ...]:
    """Hermite's six weights (n,) at u = 0 .. 1 of value, first and second derivative at 0, then at 1."""
    v, square, cube = 1 - u, u * u, u * u * u
    far, left = cube * (10 - 15 * u + 6 * square), v * v * v
    near = (1 - far, u * left * (1 + 3 * u), square * left / 2)
    return *near, far, -cube * v * (4 - 3 * u), cube * v * v / 2
