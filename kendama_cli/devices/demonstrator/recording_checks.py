"""The checks that every recording must pass: samples, extent, speed, and continuity as of a hand's motion."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.demonstrator.recording import MAX_SAMPLES, MIN_SAMPLES, Recording
from kendama_cli.devices.demonstrator.settings import PlausibleSettings
from kendama_cli.devices.demonstrator.swing_axes import check_axes
from kendama_cli.errors import InputError
from kendama_cli.motion.sampling import step_s
from kendama_cli.schema.arrays import Array


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
            where=recording.where(sample),
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
            where=recording.where(i),
            remedy="sort the samples and drop the repeated ones, or look at capture.columns.time",
        )
    usual = float(np.median(steps))
    far = np.flatnonzero(steps > gap_factor * usual)
    if len(far):
        i = int(far[0]) + 1
        raise InputError(
            recording.path,
            f"a gap of {steps[i - 1]:.4g} s, where samples come every {usual:.4g} s",
            where=recording.where(i),
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
            where=recording.where(fastest + 1),
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
            where=recording.where(fastest + 1),
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


LAG_S = 0.01
"""Accelerations are taken over so much time before and after: a ball's impact on a hand is over sooner."""
LONG_LAG_S = 0.05
"""Over so much, noise of some millimetres is no acceleration any more."""
ABOVE_NOISE = 10.0
"""A recording's own median acceleration times this is noise, for a swing's peak is 3 to 5 times its median."""

FROZEN_HIDES_M = 0.01
"""A position that stays the same while the hand moved by so much is refused: at 25 mm of error no tau catches."""
FROZEN_DOUBT_M = 0.003

DOUBT_M_S2 = 80.0
MOVING_START, MOVING_END = 0.25, 0.5
"""Fractions of the peak speed: a hand that begins or ends faster was not recorded from the beginning or to the end."""
SHORT_S = 0.6
"""A rise and a fall over the length of the rope take about as long; swings that we know take 0.7 to 3.5 s."""


def acceleration(t_s: Array, position_m: Array, lag_s: float) -> tuple[Array, int]:
    """Return the divided second differences over ``lag_s`` on either side (n - 2 k,) [m/s^2], and k samples of lag."""
    k = min(max(1, round(lag_s / step_s(t_s))), (len(t_s) - 1) // 2)
    before = (position_m[k:-k] - position_m[: -2 * k]) / (t_s[k:-k] - t_s[: -2 * k])[:, None]
    after = (position_m[2 * k :] - position_m[k:-k]) / (t_s[2 * k :] - t_s[k:-k])[:, None]
    return np.linalg.norm(after - before, axis=1) / (t_s[2 * k :] - t_s[: -2 * k]) * 2, k


def check_jumps(recording: Recording, limit_m_s2: float) -> None:
    """Raise InputError where an acceleration is above ``limit_m_s2`` and above what the recording's noise makes."""
    reached, k = acceleration(recording.t_s, recording.position_m, LAG_S)
    if reached.max() > max(limit_m_s2, ABOVE_NOISE * float(np.median(reached))):
        remedy = "rows are missing or the tracker lost the hand there: cut or fill that part, or record the swing again"
        raise _impossible(recording, reached, k, limit_m_s2, remedy)


def check_rate(recording: Recording, limit_m_s2: float) -> None:
    """Raise InputError where the hand accelerates by more than ``limit_m_s2`` for 0.1 s: no noise, but a wrong rate."""
    reached, k = acceleration(recording.t_s, recording.position_m, LONG_LAG_S)
    if reached.max() > limit_m_s2:
        times = "look at the time (capture.time_unit, capture.columns.time or capture.rate_hz); else "
        raise _impossible(recording, reached, k, limit_m_s2, times + recording.unit_remedy)


def _impossible(recording: Recording, reached: Array, k: int, limit_m_s2: float, remedy: str) -> InputError:
    t_s, position_m = recording.t_s, recording.position_m
    worst = int(reached.argmax())
    # the longest of the steps around it is the jump
    around = range(worst, min(worst + 2 * k, len(t_s) - 1))
    step = max(around, key=lambda i: float(np.linalg.norm(position_m[i + 1] - position_m[i])))
    moved_mm = 1e3 * np.linalg.norm(position_m[step + 1] - position_m[step])
    lasted_ms = 1e3 * (t_s[step + 1] - t_s[step])
    return InputError(
        recording.path,
        f"an acceleration of {reached[worst]:.0f} m/s^2 (it moves by {moved_mm:.0f} mm within {lasted_ms:.3g} ms); a "
        f"hand reaches {limit_m_s2:g}",
        where=recording.where(step + 1),
        remedy=remedy,
    )


def check_frozen(recording: Recording) -> None:
    """Raise InputError where samples stand still amid the motion, longer than a turning hand does."""
    worst = max(_frozen(recording), key=lambda one: one[2], default=None)
    if worst is not None and worst[2] >= FROZEN_HIDES_M:
        first, last, hidden_m = worst
        lasted = recording.t_s[last] - recording.t_s[first]
        raise InputError(
            recording.path,
            f"the same position for {1e3 * lasted:.0f} ms ({last - first + 1} samples) amid the motion, while the hand "
            f"moved on by about {1e3 * hidden_m:.0f} mm",
            where=recording.where(first),
            remedy="the tracker was frozen there: cut or fill that part, or record the swing again",
        )


def doubts_of_continuity(recording: Recording) -> list[str]:
    """Return suspicious but possible findings, one sentence each."""
    t_s, position_m = recording.t_s, recording.position_m
    doubts = []
    frozen = [one for one in _frozen(recording) if one[2] >= FROZEN_DOUBT_M]
    if frozen:
        first, last, hidden_m = max(frozen, key=lambda one: one[2])
        doubts.append(
            f"{recording.where(first)}: the position stays the same for {1e3 * (t_s[last] - t_s[first]):.0f} ms amid "
            f"the motion (about {1e3 * hidden_m:.0f} mm); a frozen tracker?"
        )
    reached, k = acceleration(t_s, position_m, LAG_S)
    worst = int(reached.argmax())
    if reached[worst] > max(DOUBT_M_S2, ABOVE_NOISE * float(np.median(reached))):
        doubts.append(
            f"{recording.where(worst + k)}: an acceleration of {reached[worst]:.0f} m/s^2, much above the rest of the "
            "swing; rows missing?"
        )
    duration_s = float(t_s[-1] - t_s[0])
    if duration_s < SHORT_S:
        doubts.append(f"it lasts {duration_s:.2f} s only; is the whole swing in it?")
    speeds = np.linalg.norm(np.diff(position_m, axis=0), axis=1) / np.diff(t_s)
    few = max(2, round(0.05 / step_s(t_s)))
    peak = float(np.quantile(speeds, 0.98))
    begins, ends = float(np.median(speeds[:few])), float(np.median(speeds[-few:]))
    if begins > MOVING_START * peak:
        doubts.append(
            f"the hand moves at {begins:.2g} m/s where it begins; the ball is taken to hang at rest there: record from "
            "rest, or look at capture.first_row"
        )
    if ends > MOVING_END * peak:
        doubts.append(f"the hand moves at {ends:.2g} m/s where it ends; is the catch in it?")
    return doubts


def _frozen(recording: Recording) -> list[tuple[int, int, float]]:
    """Return stretches of one position amid the motion: first and last sample, and the hand's displacement [m].

    That is the lesser of the speeds before and after, times how long it stood. A hand that turns round stands for a
    sample or two too, but does not go on by a jump.
    """
    t_s, position_m = recording.t_s, recording.position_m
    still = np.concatenate([[False], (np.diff(position_m, axis=0) == 0).all(axis=1), [False]])
    edges = np.flatnonzero(np.diff(still.astype(int)))
    few = max(2, round(0.03 / step_s(t_s)))
    found = []
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if first < few or last + 1 + few >= len(t_s):
            continue
        speeds = [
            float(np.linalg.norm(position_m[b] - position_m[a]) / (t_s[b] - t_s[a]))
            for a, b in ((first - few, first), (last + 1, last + 1 + few))
        ]
        hidden_m = min(speeds) * float(t_s[last] - t_s[first])
        if np.linalg.norm(position_m[last + 1] - position_m[last]) > 0.5 * hidden_m:
            found.append((first, last, hidden_m))
    return found
