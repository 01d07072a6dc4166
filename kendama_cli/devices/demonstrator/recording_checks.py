"""The checks that every recording must pass."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.demonstrator.continuity import check_frozen, check_jumps, check_rate, doubts_of_continuity
from kendama_cli.devices.demonstrator.recording import MAX_SAMPLES, MIN_SAMPLES, Recording
from kendama_cli.devices.demonstrator.settings import PlausibleSettings
from kendama_cli.devices.demonstrator.swing_axes import check_axes
from kendama_cli.errors import InputError


def check_samples(recording: Recording, gap_factor: float) -> None:
    """Raise InputError where samples are too few or too many, not finite, or not in the order of time without gaps."""
    _check_length(recording)
    _check_finite(recording)
    _check_time(recording, gap_factor)


def check_swing(recording: Recording, plausible: PlausibleSettings) -> list[str]:
    """Check the motion; return suspicious but possible findings.

    Raises InputError for what cannot be a swing of a hand, with the sample, the value and the remedy.
    """
    _check_extent(recording, plausible)
    check_frozen(recording)
    check_jumps(recording, plausible.max_acceleration_m_s2)
    _check_speed(recording, plausible)
    check_rate(recording, plausible.max_acceleration_m_s2)
    _check_duration(recording, plausible.min_duration_s)
    return doubts_of_continuity(recording) + check_axes(recording, plausible.axes)


def _check_length(recording: Recording) -> None:
    count = len(recording.t_s)
    if count < MIN_SAMPLES:
        rows = "no sample" if count == 0 else "one sample only" if count == 1 else f"{count} samples only"
        raise InputError(
            recording.path,
            f"{rows}; a demonstration needs at least {MIN_SAMPLES}",
            remedy="give a file that holds a whole swing, and look at capture.first_row and capture.last_row",
        )

    if count > MAX_SAMPLES:
        raise InputError(
            recording.path,
            f"{count} samples; a demonstration is one swing of at most {MAX_SAMPLES}",
            remedy="cut the swing out with capture.first_row and capture.last_row, or record at a lower rate",
        )


def _check_finite(recording: Recording) -> None:
    wrong = ~np.isfinite(np.column_stack((recording.t_s, recording.position_m)))
    if wrong.any():
        sample, column = (int(i) for i in np.argwhere(wrong)[0])
        value = recording.t_s[sample] if column == 0 else recording.position_m[sample, column - 1]
        raise InputError(
            recording.path,
            f"{'time' if column == 0 else 'xyz'[column - 1]} is {value}, not a finite number",
            where=recording.place(sample),
            remedy="fill or cut the gap in the recording, or choose rows without it",
        )


def _check_time(recording: Recording, gap_factor: float) -> None:
    steps = np.diff(recording.t_s)
    back = np.flatnonzero(steps <= 0)
    if len(back):
        i = int(back[0]) + 1
        raise InputError(
            recording.path,
            f"time does not rise: {recording.t_s[i]:.6g} s after {recording.t_s[i - 1]:.6g} s (from the first sample)",
            where=recording.place(i),
            remedy="sort the samples and drop the repeated ones, or look at capture.columns.time",
        )
    usual = float(np.median(steps))
    far = np.flatnonzero(steps > gap_factor * usual)
    if len(far):
        i = int(far[0]) + 1
        raise InputError(
            recording.path,
            f"a gap of {steps[i - 1]:.4g} s, where samples come every {usual:.4g} s",
            where=recording.place(i),
            remedy=f"fill or cut the gap, or raise capture.gap_factor ({gap_factor:g}) to bridge it",
        )


def _check_extent(recording: Recording, plausible: PlausibleSettings) -> None:
    lengths = np.linalg.norm(np.diff(recording.position_m, axis=0), axis=1)
    steps = np.diff(recording.t_s)
    speeds = lengths / steps
    fastest = int(np.argmax(speeds))
    limit = plausible.max_speed_m_s
    # one wild step among quiet ones is a jump; where many are fast, unit or rate are wrong for the whole file
    if speeds[fastest] > limit and speeds[fastest] > 10 * float(np.quantile(speeds, 0.95)):
        raise InputError(
            recording.path,
            f"the position jumps by {lengths[fastest]:.4g} m within {steps[fastest]:.4g} s",
            where=recording.place(fastest + 1),
            remedy="samples are missing or a marker was lost there: fill or cut the gap",
        )
    extent = float(np.ptp(recording.position_m, axis=0).max())
    if not plausible.min_extent_m <= extent <= plausible.max_extent_m:
        raise InputError(
            recording.path,
            f"the swing extends over {extent:.4g} m; a hand's swing takes {plausible.min_extent_m:g} to "
            f"{plausible.max_extent_m:g} m",
            remedy=recording.unit_remedy,
        )


def _check_speed(recording: Recording, plausible: PlausibleSettings) -> None:
    speeds = np.linalg.norm(np.diff(recording.position_m, axis=0), axis=1) / np.diff(recording.t_s)
    fastest = int(np.argmax(speeds))
    peak, limit = float(speeds[fastest]), plausible.max_speed_m_s
    if not plausible.min_peak_speed_m_s <= peak <= limit:
        raise InputError(
            recording.path,
            f"the peak speed is {peak:.4g} m/s; a hand's swing reaches {plausible.min_peak_speed_m_s:g} to "
            f"{limit:g} m/s",
            where=recording.place(fastest + 1),
            remedy="look at the time (capture.time_unit, capture.columns.time or capture.rate_hz); else "
            + recording.unit_remedy,
        )


def _check_duration(recording: Recording, least_s: float) -> None:
    duration_s = float(recording.t_s[-1] - recording.t_s[0])
    if duration_s < least_s:
        raise InputError(
            recording.path,
            f"it lasts {duration_s:.3g} s; a swing from the hanging ball to the catch takes at least {least_s:g} s",
            remedy="record the whole swing, or look at capture.first_row, capture.last_row and the time",
        )
