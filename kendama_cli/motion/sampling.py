"""Samples over time: step and thinning of times, and columns between their samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.schema.arrays import Array


def step_s(t_s: Array) -> float:
    """Return the median step between the times ``t_s`` (n,) [s]."""
    return float(np.median(np.diff(t_s)))


def thinning(t_s: Array, every_s: float) -> int:
    """Return which fraction of the samples at ``t_s`` (n,), one in so many, come about every ``every_s``."""
    return max(1, round(every_s / float(np.diff(t_s).mean())))


def columns_at(at_s: Array | float, t_s: Array | Sequence[float], columns: Array) -> Array:
    """Return ``columns`` (n, k) of the times ``t_s`` (n,) at ``at_s`` (m,): on straight lines, held beyond the ends.

    The result is (m, k), or (k,) where ``at_s`` is one time.
    """
    return np.stack([np.interp(at_s, t_s, column) for column in columns.T], axis=-1)
