"""The step of minimum jerk from rest to rest (T. Flash and N. Hogan, J. Neurosci. 5(7), 1985).

s(u) = 10 u^3 - 15 u^4 + 6 u^5,   u = t / T in [0, 1]; before and after it rests at 0 and 1
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.schema.arrays import Array

PEAK_RATE = 1.875
"""ds/du at its maximum, midway: the peak of the speed over its mean."""


def step(share: ArrayLike) -> Array:
    """Return s at the fractions u (...) of the step's duration."""
    u = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0)
    return np.asarray(u**3 * (10 - 15 * u + 6 * u**2))


def step_rate(share: ArrayLike) -> Array:
    """Return ds/du (...)."""
    u = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0)
    return np.asarray(30 * u**2 * (1 - u) ** 2)


def step_change(share: ArrayLike) -> Array:
    """Return d2s/du2 (...)."""
    u = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0)
    return np.asarray(60 * u * (1 - u) * (1 - 2 * u))


def step_integral(share: ArrayLike) -> Array:
    """Return the integral of s from 0 to u (...), up to the step's end at u = 1."""
    u = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0)
    return np.asarray(u**4 * (2.5 - 3 * u + u**2))
