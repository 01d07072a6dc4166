"""Outliers among demonstrations, and demonstrations that were recorded along other axes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array

FEWEST = 4
"""Below so many demonstrations nobody can say which of them stands apart."""

APART = 3.5
"""Robust standard deviations from the others, times 1 + 4 / N: the median of a few distances is itself uncertain."""

LEAST_APART_M = 0.005
"""Demonstrations nearer than this to the others are never apart, however alike those are."""

LEAST_APART_SHARE = 0.1
"""The same for durations."""

ALIKE = 0.9
"""Paths agree where they correlate so well."""

BETTER = 4.0
"""Other axes must leave so many times less of a path unexplained."""


def apart(paths: Array, durations_s: Array) -> NDArray[np.bool_]:
    """Return a mask (N,) of the ``paths`` (N, n, c), at equal fractions, or of the durations (N,) that are outliers.

    Judged by the rms distance to the median path and by the logarithm of the duration against its median, each over
    1.4826 times the median of all N (the standard deviation of a normal distribution).
    """
    if len(paths) < FEWEST:
        return np.zeros(len(paths), dtype=bool)
    distance = np.sqrt(np.mean(np.sum((paths - np.median(paths, axis=0)) ** 2, axis=2), axis=1))
    length = np.log(durations_s)
    longer = np.abs(length - np.median(length))
    return _far(distance, LEAST_APART_M) | _far(longer, LEAST_APART_SHARE)


def _far(distance: Array, least: float) -> NDArray[np.bool_]:
    limit = max(least, APART * (1 + 4 / len(distance)) * 1.4826 * float(np.median(distance)))
    return np.asarray(distance > limit)


def axes_of(path: Array, others: Sequence[Array], names: Sequence[str]) -> str | None:
    """Return the axes, as text, by which ``path`` (n, c) agrees with ``others``; None if it agrees as it is or
    never can.

    Only where the others agree with each other.
    """
    if len(others) < FEWEST - 1:
        return None
    middle = np.median(np.array(others), axis=0)
    if np.quantile([_alike(one, middle) for one in others], 0.25) < ALIKE:
        return None
    as_it_is = _alike(path, middle)
    if as_it_is > ALIKE:
        return None
    # an axis along which nobody moves has no order and no sign worth telling
    still = np.sqrt(np.mean(middle**2, axis=0)) < 0.1 * np.sqrt(np.mean(middle**2, axis=0)).max()
    best, found = max(ALIKE, 1 - (1 - as_it_is) / BETTER), None
    for order in permutations(range(path.shape[1])):
        for signs in product((1, -1), repeat=path.shape[1]):
            if any(still[i] and sign < 0 for i, sign in enumerate(signs)):
                continue
            similarity = _alike(path[:, order] * signs, middle)
            if similarity > best:
                best = similarity
                found = ", ".join(
                    f"{names[i]} is its {'-' if signs[i] < 0 else ''}{names[order[i]]}"
                    for i in range(len(order))
                    if not still[i] and (order[i] != i or signs[i] < 0)
                )
    return found


def _alike(path: Array, other: Array) -> float:
    """Return the correlation of two paths (n, c), from -1 to 1."""
    a, b = path - path.mean(axis=0), other - other.mean(axis=0)
    return float(np.vdot(a, b) / max(np.sqrt(np.vdot(a, a) * np.vdot(b, b)), 1e-12))
