"""Rests of a hand-held sensor: stretches in which gyroscope and accelerometer are quiet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from kendama_cli.schema.arrays import Array

WINDOW_S = 0.12
QUIET_RAD_S, QUIET_M_S2 = 0.05, 0.25
"""Deviations (rms) that a hand's tremor and a phone's noise stay below."""
TIMES_NOISE = 3.0
"""A sensor noisier than that is quiet below so many times its own quietest tenth."""
MIN_S, BETWEEN_S, BEFORE_S = 0.2, 0.5, 0.3
LOOSE = 4.0
USED_S = 0.8
"""So much of a rest, next to the motion, is used."""


@dataclass(frozen=True)
class Rest:
    """Samples ``first`` to ``last`` (both included) of a rest."""

    first: int
    last: int


def find_rests(step_s: float, force: Array, rate: Array) -> list[Rest]:
    """Return the rests in even samples (n, 3) of specific force and rotation rate, in order.

    A rest lasts 0.2 s, between two motions 0.5 s. Where the recording does not begin and end quietly, a hand that
    trembles or turns more counts as well.
    """
    found: list[Rest] = []
    for allowed in (1.0, LOOSE):
        found = _quiet(step_s, force, rate, allowed)
        if found and found[0].first * step_s < BEFORE_S and (len(force) - 1 - found[-1].last) * step_s < BEFORE_S:
            break
    inner_s = [(one.last - one.first) * step_s for one in found]
    return [one for i, one in enumerate(found) if i in (0, len(found) - 1) or inner_s[i] >= BETWEEN_S]


def _quiet(step_s: float, force: Array, rate: Array, allowed: float) -> list[Rest]:
    """Return the stretches in which both sensors stay within ``allowed`` times their limits."""
    width = max(5, round(WINDOW_S / step_s) | 1)
    quiet = np.ones(len(force), dtype=bool)
    for values, limit in ((rate, allowed * QUIET_RAD_S), (force, allowed * QUIET_M_S2)):
        mean, square = (uniform_filter1d(one, width, axis=0, mode="nearest") for one in (values, values**2))
        spread = np.sqrt(np.maximum(square - mean**2, 0).sum(axis=1))
        still = spread < max(limit, min(TIMES_NOISE * float(np.quantile(spread, 0.1)), 2 * limit))
        if values is rate and still.any():  # a steady turn is no rest
            still &= np.linalg.norm(mean - np.median(mean[still], axis=0), axis=1) < limit
        quiet &= still
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(int)))
    found = []
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        first = begin if begin == 0 else begin + width // 4
        last = end - 1 if end == len(quiet) else end - 1 - width // 4
        if (last - first) * step_s >= MIN_S - 1e-9:
            found.append(Rest(first, last))
    return found
