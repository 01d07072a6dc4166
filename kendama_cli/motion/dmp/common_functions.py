"""The functions that a primitive's positions are made of, orthonormal over the motion, to be read at any share.

What a basis and its ends can draw is one space of functions, whatever the samples. So its columns
(``response_columns``) are made orthonormal once, q(s) = T' columns(s). Over many samples q is nearly orthogonal still:
normal equations of q lose nothing, where those of the columns would lose half of the digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kendama_cli.motion.dmp.even_samples import GramSeries, gram_series
from kendama_cli.motion.dmp.response_columns import ResponseColumns, read_rows
from kendama_cli.schema.arrays import Array


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
