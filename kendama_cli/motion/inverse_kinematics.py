"""Resolving a task's motion into joint motion where there are more joints than the task needs."""

from __future__ import annotations

import numpy as np

from kendama_cli.schema.arrays import Array


def weighted_step(jacobian: Array, change: Array, weights: Array, damping: float = 1e-9) -> Array:
    """The joint step (n,) that makes the task ``change`` (t,) with the least weighted sum of squares.

        dq = W^-1 J^T (J W^-1 J^T + damping trace/t)^-1 dx

    J is ``jacobian`` (t, n), W the diagonal of ``weights`` (n,). With the inverse squares of the speed limits as
    weights, a slow joint is spared in favour of a fast one. ``damping``, relative, keeps the step finite where J
    loses rank.
    """
    spread = jacobian / weights
    square = spread @ jacobian.T
    square += np.eye(len(square)) * (damping * np.trace(square) / len(square))
    return np.asarray(spread.T @ np.linalg.solve(square, change))
