"""Stamps that a server gives when it hears of a pose, put back to the steady rate at which trackers see."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array

HARMLESS_SHARE = 0.05
"""Stamps that stray from a steady rate by less of its period are left as they are."""
STRAYS_MOST_S = 0.05
"""A network holds poses back for so long now and then; a hand's swing bent by more would be another."""
FEWEST, SOME = 10, 25


def even_times(stamps_s: Array) -> Array | None:
    """Times (n,) at a steady rate, nearest to rising stamps (n,); None where they need none, or keep to no rate.

    Two poses that are heard of together look like a jump, for cameras see at a steady rate and only the stamp is late.
    The poses are numbered one after the other, or, as some may be missing, by their steps in periods; the times are
    the least-squares line through (number, stamp), of the numbering that fits better. Stamps may stray from it by
    STRAYS_MOST_S, or by half a period where the numbers are found by rounding; the mean of 25 by half a period, or the
    rate itself changes.
    """
    steps = np.diff(stamps_s)
    usual = float(np.median(steps))
    if len(stamps_s) < FEWEST or not usual > 0:
        return None
    counted = np.arange(len(stamps_s))
    rounded = np.concatenate([[0], np.cumsum(np.maximum(np.rint(steps / usual), 1))])
    lines = [_line(numbers, stamps_s) for numbers in (counted, rounded)]
    rms = [float(np.std(line - stamps_s)) for line in lines]
    best = int(rms[1] < rms[0])
    period_s = float(np.diff(lines[best]).min())
    strays_s = float(np.abs(lines[best] - stamps_s).max())
    some = min(SOME, len(stamps_s))
    drifts_s = float(np.abs(np.convolve(stamps_s - lines[best], np.full(some, 1 / some), "valid")).max())
    if drifts_s > 0.5 * period_s:
        return None
    if not HARMLESS_SHARE * period_s <= strays_s < (STRAYS_MOST_S, 0.5 * period_s)[best]:
        return None
    return lines[best]


def _line(numbers: NDArray[Any], stamps_s: Array) -> Array:
    period_s, begin_s = np.polyfit(numbers, stamps_s, 1)
    return np.asarray(period_s * numbers + begin_s)
