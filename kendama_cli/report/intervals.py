"""Intervals of 95 % over runs: the one law by which sweeps, reports and comparisons say how sure a figure is.

``tests/report/test_intervals.py`` measures how often each holds the true figure, on the heavy-tailed rollouts to solved
of the product among others.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.special import bdtr, stdtrit

from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.schema.arrays import Array

RESAMPLES = 4000
MIN_SPREAD = 0.1
"""A resample's standard error counts as at least this fraction of the sample's: a resample without the few values that
differ has none, and its t would be without bound."""
_SEED = 1979
_TAIL = 0.025
_QUARTER = 0.25
_SMALL = 1e-9

Between = tuple[float, float]


def quantile_interval(values: Array, q: float = 0.5) -> Between | None:
    """Return the interval of the quantile ``q``, by default the median, between two order statistics of ``values``.

    It is exact for any distribution: with k of n values below the quantile, k is binomial (W. Thompson, Annals of
    Mathematical Statistics 7, 1936). None where n is too small: below 6 for the median.
    """
    ordered, n = np.sort(np.asarray(values, dtype=np.float64)), len(values)
    below = bdtr(np.arange(n, dtype=np.float64), n, q)  # of at most k values
    low, high = int(np.searchsorted(below, _TAIL, "right")), int(np.searchsorted(below, 1.0 - _TAIL))
    return (float(ordered[low - 1]), float(ordered[high])) if low > 0 and high < n else None


def interquartile_mean(values: Any) -> Any:
    """Return the mean of the middle half along the first axis, what lies on its two edges counted in part (Agarwal et
    al., NeurIPS 2021).
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64), axis=0)
    n = len(ordered)
    weights = np.clip(np.minimum(np.arange(1, n + 1), np.arange(n, 0, -1)) - n * _QUARTER, 0.0, 1.0)
    return np.tensordot(weights / weights.sum(), ordered, axes=1)


def interquartile_interval(values: Array) -> tuple[Any, Any] | None:
    """Return the interval of the interquartile mean along the first axis of ``values`` (n, ...); None below 3 values.

    Its standard error is that of the values drawn in to the quarters (J. Tukey and D. McLaughlin, Sankhya A 25, 1963),
    and it follows Student's t with two degrees fewer for each pair that is drawn in.
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64), axis=0)
    n, cut = len(ordered), int(len(ordered) * _QUARTER)
    if n < 3:
        return None
    drawn_in = np.clip(ordered, ordered[cut], ordered[n - 1 - cut])
    half = stdtrit(n - 2 * cut - 1, 1.0 - _TAIL) * _standard_error(drawn_in, axis=0) / (1.0 - 2.0 * _QUARTER)
    middle = interquartile_mean(ordered)
    return middle - half, middle + half


def mean_interval(values: Array) -> Between | None:
    """Return the interval of the mean of ``values`` (n,) by the bootstrap-t; None for one value. Always the same.

    Student's t is replaced by what resamples show of it (B. Efron 1979; P. Hall, Annals of Statistics 16, 1988), so a
    long tail makes the interval longer on its side.
    """
    if len(values) < 2:
        return None
    sample, resamples = _resampled(values, _SEED)
    return _student(*_mean(sample), *_mean(resamples))


def rate_interval(values: Array) -> Between | None:
    """Return the interval of the mean of rates ``values`` (n,), which lies within 0 and 1."""
    found = mean_interval(values)
    return None if found is None else (max(0.0, found[0]), min(1.0, found[1]))


def ratio_interval(values: Array, reference: Array) -> Between | None:
    """Return the interval of mean(values) / mean(reference), of positive values that do not depend on each other.

    It is the bootstrap-t of the ratio's logarithm. None where either has but one value or a mean is not positive.
    """
    if min(len(values), len(reference)) < 2 or min(np.mean(values), np.mean(reference)) <= 0.0:
        return None
    (above, all_above), (below, all_below) = _resampled(values, _SEED), _resampled(reference, _SEED + 1)
    low_high = _student(*_log_ratio(above, below), *_log_ratio(all_above, all_below))
    low, high = np.exp(low_high).tolist()
    return low, high


def improvement(values: Array, reference: Array) -> tuple[float, Between]:
    """Return the probability that one of ``values`` is smaller than one of ``reference``, and its interval.

    It is the fraction of all pairs, equal ones counted half (Agarwal et al., NeurIPS 2021). The interval is the exact
    one of as many pairs as have no value in common, so that it is never too short.
    """
    first, second = np.asarray(values)[:, None], np.asarray(reference)[None]
    fraction = float(np.mean((first < second) + 0.5 * (first == second)))
    pairs = min(len(values), len(reference))
    return fraction, success_interval(fraction * pairs, pairs)


def _resampled(values: Array, seed: int) -> tuple[Array, Array]:
    """Return the values in order (n,), and resamples of them (RESAMPLES, n)."""
    ordered, n = np.sort(np.asarray(values, dtype=np.float64)), len(values)
    return ordered, ordered[np.random.default_rng(seed).integers(n, size=(RESAMPLES, n))]


def _mean(values: Array) -> tuple[Any, Any]:
    return values.mean(axis=-1), _standard_error(values, axis=-1)


def _log_ratio(values: Array, reference: Array) -> tuple[Any, Any]:
    (above, error_above), (below, error_below) = _mean(values), _mean(reference)
    above, below = np.maximum(above, _SMALL), np.maximum(below, _SMALL)
    return np.log(above / below), np.hypot(error_above / above, error_below / below)


def _standard_error(values: Array, axis: int) -> Any:
    return values.std(axis=axis, ddof=1) / math.sqrt(values.shape[axis])


def _student(figure: float, error: float, figures: Array, errors: Array) -> Between:
    if error == 0.0:
        return float(figure), float(figure)
    low, high = np.quantile((figures - figure) / np.maximum(errors, MIN_SPREAD * error), [_TAIL, 1.0 - _TAIL])
    return float(figure - high * error), float(figure - low * error)
