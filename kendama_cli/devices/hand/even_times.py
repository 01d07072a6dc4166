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
STALL_MOST_S, STALLED_MOST_SHARE = 1.0, 0.2
"""A stalled computer hears of poses so late, of so many of all, and then of all of them at once."""
FEWEST, SOME = 10, 25


def even_times(stamps_s: Array) -> Array | None:
    """Times (n,) at a steady rate, nearest to rising stamps (n,); None where they need none, or keep to no rate.

    Two poses that are heard of together look like a jump, for cameras see at a steady rate and only the stamp is late.
    The poses are numbered one after the other, or, as some may be missing, by their steps in periods; the times are
    the least-squares line through (number, stamp), of the numbering that fits better. Stamps may stray from it by
    STRAYS_MOST_S, or by half a period where the numbers are found by rounding; the mean of 25 by half a period, or the
    rate itself changes. Poses that a stall held back are left out of the line: they are late by less and less, and
    those after them are on the line again, so that none can be missing.
    """
    steps = np.diff(stamps_s)
    usual = float(np.median(steps)) or float(np.mean(steps))  # coarse stamps: every other step is none
    if len(stamps_s) < FEWEST or not usual > 0:
        return None
    counted = np.arange(len(stamps_s))
    rounded = np.concatenate([[0], np.cumsum(np.maximum(np.rint(steps / usual), 1))])
    stalled = _stalled(counted, stamps_s)
    used = ~stalled
    numberings = (counted,) if stalled.any() or steps.min() <= 0 else (counted, rounded)
    lines = [_line(numbers, stamps_s, used) for numbers in numberings]
    best = int(np.argmin([np.std(line - stamps_s) for line in lines]))
    period_s = float(np.diff(lines[best]).min())
    strays = (stamps_s - lines[best])[used]
    some = min(SOME, len(strays))
    drifts_s = float(np.abs(np.convolve(strays, np.full(some, 1 / some), "valid")).max())
    if drifts_s > 0.5 * period_s:
        return None
    strays_s = float(np.abs(strays).max())
    if not stalled.any() and strays_s < HARMLESS_SHARE * period_s:
        return None
    return lines[best] if strays_s < (STRAYS_MOST_S, 0.5 * period_s)[best] else None


def _stalled(numbers: NDArray[Any], stamps_s: Array) -> NDArray[np.bool_]:
    """Which poses (n,) a stall of more than STRAYS_MOST_S held back; none where it may be anything else."""
    none = np.zeros(len(stamps_s), dtype=bool)
    late_s = stamps_s - _robust_line(numbers, stamps_s)
    period_s = float(np.median(np.diff(stamps_s)))
    stalled = none.copy()
    for first in np.flatnonzero(late_s > STRAYS_MOST_S).tolist():
        if not stalled[first]:  # from here on to where they are on the line again
            back = np.flatnonzero(late_s[first:] < 0.5 * period_s)
            if len(back) == 0 or (np.diff(late_s[first : first + back[0]]) > 0.5 * period_s).any():
                return none
            stalled[first : first + back[0]] = True
    believed = stalled.mean() <= STALLED_MOST_SHARE and late_s.max() < STALL_MOST_S and late_s.min() > -STRAYS_MOST_S
    return stalled if believed else none


def _line(numbers: NDArray[Any], stamps_s: Array, used: NDArray[np.bool_]) -> Array:
    period_s, begin_s = np.polyfit(numbers[used], stamps_s[used], 1)
    return np.asarray(period_s * numbers + begin_s)


def _robust_line(numbers: NDArray[Any], stamps_s: Array) -> Array:
    """The line of least absolute distances, by iterated weights; a fifth of stamps that are late does not move it."""
    weights = np.ones(len(stamps_s))
    for _ in range(30):
        period_s, begin_s = np.polyfit(numbers, stamps_s, 1, w=weights)
        line = np.asarray(period_s * numbers + begin_s)
        weights = 1 / np.sqrt(np.maximum(np.abs(stamps_s - line), 1e-6))
    return line
