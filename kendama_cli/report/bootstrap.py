"""Intervals by the bootstrap: how far a figure would move if other seeds had been drawn (Efron 1979)."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from kendama_cli.report.tracks import Array

RESAMPLES = 4000
_SEED = 1979


class Statistic(Protocol):
    """A figure along the last axis of an array."""

    def __call__(self, values: Any, /, *, axis: int) -> Any:
        """Return the figure of every row."""


def p90(values: Any, /, *, axis: int) -> Any:
    """Return the 90 % quantile."""
    return np.quantile(values, 0.9, axis=axis)


def interquartile_mean(values: Any, /, *, axis: int) -> Any:
    """Return the mean of the middle half, what lies on its two edges counted in part (Agarwal et al., NeurIPS 2021)."""
    ordered = np.sort(np.asarray(values, dtype=np.float64), axis=axis)
    n = ordered.shape[axis]
    weights = np.clip(np.minimum(np.arange(1, n + 1), np.arange(n, 0, -1)) - n / 4, 0.0, 1.0)
    return np.tensordot(ordered, weights / weights.sum(), axes=(axis, 0))


def bootstrap(values: Array, statistic: Statistic) -> tuple[float, float] | None:
    """Return the 95 % percentile interval of ``statistic`` over ``values`` (n,); None for one value. Always the
    same.
    """
    return _between(_resampled(values, statistic, _SEED)) if len(values) > 1 else None


def bootstrap_curve(curves: Array, statistic: Statistic) -> tuple[Array, Array]:
    """Return the 95 % percentile interval of ``statistic`` over ``curves`` (n, points), at each point; whole curves are
    drawn.

    Fewer resamples than for single figures: a band that is drawn needs no more.
    """
    picked = np.random.default_rng(_SEED).integers(len(curves), size=(RESAMPLES // 10, len(curves)))
    low, high = np.quantile([statistic(curves[one], axis=0) for one in picked], [0.025, 0.975], axis=0)
    return low, high


def bootstrap_ratio(values: Array, reference: Array, statistic: Statistic) -> tuple[float, float] | None:
    """Return the 95 % percentile interval of statistic(values) / statistic(reference), both resampled independently.

    None where either has but one value.
    """
    if min(len(values), len(reference)) < 2:
        return None
    return _between(_resampled(values, statistic, _SEED) / _resampled(reference, statistic, _SEED + 1))


def _resampled(values: Array, statistic: Statistic, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    return np.asarray(statistic(ordered[rng.integers(len(ordered), size=(RESAMPLES, len(ordered)))], axis=1))


def _between(figures: Array) -> tuple[float, float]:
    low, high = np.quantile(figures, [0.025, 0.975])
    return float(low), float(high)
