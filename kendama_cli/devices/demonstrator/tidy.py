"""Samples as a tracker saw them, of what a recorder wrote: repeated rows, held positions and straying stamps corrected.

Each correction is reported. Nothing is corrected that could be the motion itself.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.demonstrator.recording import MIN_SAMPLES, Recording
from kendama_cli.motion.dmp.onset import SmoothSpeed
from kendama_cli.motion.sampling import step_s
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import count_of

HARMLESS_FRACTION = 0.05
"""Stamps that stray from a steady rate by less of its period are left as they are."""
MAX_STRAY_S = 0.05
"""A network holds poses back for so long now and then; a hand's swing bent by more would be another."""
MAX_STALL_S, MAX_STALLED_FRACTION = 1.0, 0.2
"""A stalled computer hears of poses so late, of so many of all, and then of all of them at once."""
MIN_POSES, DRIFT_POSES = 10, 25

FAST_FRACTION, FAST_WINDOW_S = 0.3, 0.1
"""Fraction of the peak speed over so long: a hand that moves so fast is at no position twice."""
HELD_FRACTION = 0.2
"""Fraction of a fast hand's rows that repeat the position before: from here on the tracker is slower than the file."""
LONG_HOLD = 2.5
"""A position that is held so many times longer than usual was lost, not held."""


def tidied(recording: Recording, times: str) -> Recording:
    """Return the recording without repeated rows and held positions, and with even times unless they are ``stamps``."""
    if (
        len(recording.t_s) < MIN_SAMPLES
        or not np.isfinite(np.column_stack([recording.t_s, recording.position_m])).all()
    ):
        return recording  # the checks of a swing say what is wrong
    once = _held_once(_rows_once(recording))
    return once if times == "stamps" else _evened(once)


def _rows_once(recording: Recording) -> Recording:
    """Remove rows that repeat an earlier one to the digit, time and all.

    None are where rows of one time differ: then the stamps are coarse, and a hand at rest has the same position twice.
    """
    parts = [recording.t_s[:, None], recording.position_m, recording.rotation_wxyz, recording.ball_m]
    table = np.ascontiguousarray(np.hstack([part for part in parts if part is not None]))
    whole = table.view([("", table.dtype)] * table.shape[1])[:, 0]
    first = np.sort(np.unique(whole.view(f"V{table.dtype.itemsize * table.shape[1]}"), return_index=True)[1])
    if (repeats := len(table) - len(first)) == 0 or len(np.unique(recording.t_s)) < len(first):
        return recording
    return _told(recording.rows(first), f"used once: {count_of(repeats, 'row')} like an earlier one to the digit")


def _held_once(recording: Recording) -> Recording:
    """Keep once the positions that a recorder wrote again, without a newer one, at the tracker's steady rate.

    A new position is written late by up to one row, so that its stamps stray about ticks a + P k, which are found by
    numbering them and a line of least squares. Where the hand is slow, a position may stay: each tick has a sample.
    """
    t_s, position_m = recording.t_s, recording.position_m
    if len(t_s) < MIN_SAMPLES or np.diff(t_s).min() <= 0:  # rows may be gone
        return recording
    speed = SmoothSpeed(t_s, position_m).over(FAST_WINDOW_S)
    fast = speed > FAST_FRACTION * speed.max()
    new = np.concatenate([[True], (np.diff(position_m, axis=0) != 0).any(axis=1)])
    fraction = float(1 - new[fast].mean()) if fast.any() else 0.0
    begins = np.flatnonzero(new)
    steps_s = np.diff(t_s[begins])[fast[begins][1:]]
    if fraction < HELD_FRACTION or len(steps_s) < MIN_SAMPLES // 2:
        return recording
    rows, at_s, period_s = _ticks(t_s, begins, fast, steps_s)
    text = (
        f"{fraction:.0%} of the rows of the moving hand repeat the position before: the tracker delivers "
        f"{1 / period_s:.1f} Hz, and each position is used once"
    )
    return _told(replace(recording.rows(rows), t_s=at_s - at_s[0]), text)


def _ticks(
    t_s: Array, begins: NDArray[np.int64], fast: NDArray[np.bool_], steps_s: Array
) -> tuple[NDArray[np.int64], Array, float]:
    """Return the row of each of the tracker's ticks, their times, and the period between them [s]."""
    period_s = float(steps_s[steps_s <= LONG_HOLD * np.median(steps_s)].mean())
    number = np.concatenate([[0], np.cumsum(np.maximum(np.rint(np.diff(t_s[begins]) / period_s), 1))])
    for _ in range(3):
        period_s, first_s = np.polyfit(number, t_s[begins], 1)
        number = np.rint((t_s[begins] - first_s) / period_s)
        number = np.maximum.accumulate(number - np.arange(len(number))) + np.arange(len(number))  # each its own
    last = number[-1] + max(round(float(t_s[-1] - t_s[begins[-1]]) / period_s), 0) + 1
    counts = np.diff(np.append(number, last)).astype(np.int64)
    counts[fast[begins]] = 1  # what was lost amid the motion is not there
    inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    at_s = first_s + period_s * (np.repeat(number, counts) + inside)
    return np.repeat(begins, counts), np.asarray(at_s), float(period_s)


def _evened(recording: Recording) -> Recording:
    """Replace stamps that stray by the steady rate's times, if the motion is smoother so: else they are right."""
    stamps_s, position_m = recording.t_s, recording.position_m
    even_s = even_times(stamps_s)
    if even_s is None:
        return recording
    order = np.argsort(stamps_s, kind="stable")
    if _roughness(even_s, position_m) >= _roughness(stamps_s[order], position_m[order]):
        return recording
    text = (
        f"stamps stray by up to {1e3 * float(np.abs(even_s - stamps_s).max()):.1f} ms from a steady "
        f"{1 / float(np.diff(even_s).min()):.1f} Hz, whose times are taken (capture.times=stamps keeps them)"
    )
    return _told(replace(recording, t_s=even_s - even_s[0]), text)


def _roughness(t_s: Array, position_m: Array) -> float:
    """Return the mean change of velocity from step to step [m/s], infinite if two samples have one time."""
    steps_s = np.diff(t_s)[:, None]
    if steps_s.min() <= 0:
        return float("inf")
    return float(np.linalg.norm(np.diff(np.diff(position_m, axis=0) / steps_s, axis=0), axis=1).mean())


def _told(recording: Recording, what: str) -> Recording:
    return replace(recording, warnings=(*recording.warnings, f"{recording.name}: {what}"))


def even_times(stamps_s: Array) -> Array | None:
    """Return times (n,) at a steady rate, nearest to rising stamps (n,); None if none are needed or no rate fits.

    Two poses that are heard of together look like a jump, for cameras see at a steady rate and only the stamp is late.
    The poses are numbered one after the other, or, as some may be missing, by their steps in periods; the times are
    the least-squares line through (number, stamp), of the numbering that fits better. Stamps may stray from it by
    MAX_STRAY_S, or by half a period where the numbers are found by rounding; the mean of 25 by half a period, or the
    rate itself changes. Poses that a stall held back are left out of the line: they are late by less and less, and
    those after them are on the line again, so that none can be missing.
    """
    steps = np.diff(stamps_s)
    usual = float(np.median(steps)) or float(np.mean(steps))  # coarse stamps: every other step is none
    if len(stamps_s) < MIN_POSES or not usual > 0:
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
    some = min(DRIFT_POSES, len(strays))
    drifts_s = float(np.abs(np.convolve(strays, np.full(some, 1 / some), "valid")).max())
    if drifts_s > 0.5 * period_s:
        return None
    strays_s = float(np.abs(strays).max())
    if not stalled.any() and strays_s < HARMLESS_FRACTION * period_s:
        return None
    return lines[best] if strays_s < (MAX_STRAY_S, 0.5 * period_s)[best] else None


def _stalled(numbers: NDArray[Any], stamps_s: Array) -> NDArray[np.bool_]:
    """Return the mask (n,) of poses that a stall of more than MAX_STRAY_S held back; none where that is not sure."""
    none = np.zeros(len(stamps_s), dtype=bool)
    late_s = stamps_s - _robust_line(numbers, stamps_s)
    period_s = step_s(stamps_s)
    stalled = none.copy()
    for first in np.flatnonzero(late_s > MAX_STRAY_S).tolist():
        if not stalled[first]:  # from here on to where they are on the line again
            back = np.flatnonzero(late_s[first:] < 0.5 * period_s)
            if len(back) == 0 or (np.diff(late_s[first : first + back[0]]) > 0.5 * period_s).any():
                return none
            stalled[first : first + back[0]] = True
    believed = stalled.mean() <= MAX_STALLED_FRACTION and late_s.max() < MAX_STALL_S and late_s.min() > -MAX_STRAY_S
    return stalled if believed else none


def _line(numbers: NDArray[Any], stamps_s: Array, used: NDArray[np.bool_]) -> Array:
    period_s, begin_s = np.polyfit(numbers[used], stamps_s[used], 1)
    return np.asarray(period_s * numbers + begin_s)


def _robust_line(numbers: NDArray[Any], stamps_s: Array) -> Array:
    """Fit the line of least absolute distances, by iterated weights; a fifth of late stamps does not move it."""
    weights = np.ones(len(stamps_s))
    for _ in range(30):
        period_s, begin_s = np.polyfit(numbers, stamps_s, 1, w=weights)
        line = np.asarray(period_s * numbers + begin_s)
        weights = 1 / np.sqrt(np.maximum(np.abs(stamps_s - line), 1e-6))
    return line
