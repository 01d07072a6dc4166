"""Doubts about a reconstructed swing, from its own recording: refusals, warnings, and the line of its likely error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.errors import InputError
from kendama_cli.plugins.phone.estimate import Evidence, Motion
from kendama_cli.plugins.phone.rests import BEFORE_S, MIN_S, Rest
from kendama_cli.plugins.phone.tables import Signal
from kendama_cli.schema.arrays import Array

HOLD = "hold the phone still for a second before and after a swing of less than two seconds, and record again"
GOOD_TILT_DEG, MAX_TILT_DEG = 0.5, 3.0
MAX_FORCE_CHANGE_M_S2, MAX_RATE_CHANGE_DEG_S = 0.1, 0.3
MAX_VELOCITY_LEFT_M_S = 1.0
"""Sensors that leave so much have measured no swing of a hand, which reaches 0.5 to 3 m/s."""
LONG_S, SHORT_REST_S, GREAT_TURN_DEG = 2.0, 0.5, 60.0
MAX_PAUSE_S = 1.0
POOR_M = 0.15
"""A swing bent by 30 to 90 mm was still caught."""
FAST_RAD_S, FAST_M_S2 = 8.0, 35.0
"""Beyond, phones of 8 g and 2000 deg/s are not yet at their limit, but their scale errors weigh."""
FLAT_SAMPLES, FLAT_FRACTION = 3, 1e-4
UNSEEN = "scale, heading and mirror of the path cannot be seen in it"


@dataclass(frozen=True)
class Signals:
    """Both sensors of a recording as splines, even times ``t_s`` (n,) within both, and the samples as recorded."""

    t_s: Array
    force: CubicSpline
    rate: CubicSpline
    accelerometer: Signal
    gyroscope: Signal
    max_gap_s: float

    @property
    def step_s(self) -> float:
        """Time between the even samples [s]."""
        return float(self.t_s[1] - self.t_s[0])

    @property
    def rate_hz(self) -> float:
        """Rate of the even samples [Hz]."""
        return 1 / self.step_s


def check_rests(path: str, rests: Sequence[Rest], count: int, step_s: float) -> None:
    """Raise InputError unless the recording begins and ends in a rest, with a motion between."""
    if not rests:
        raise InputError(path, f"the phone is never still for {MIN_S:g} s", remedy=HOLD)
    before_s, after_s = rests[0].first * step_s, (count - 1 - rests[-1].last) * step_s
    if before_s > BEFORE_S or after_s > BEFORE_S:
        where = "begins" if before_s > BEFORE_S else "ends"
        time_s = before_s if before_s > BEFORE_S else after_s
        raise InputError(path, f"it {where} without a rest ({time_s:.1f} s of motion)", remedy=HOLD)
    if len(rests) == 1:
        raise InputError(path, "the phone is still throughout", remedy="record a swing")


def check_motion(path: str, found: Evidence) -> None:
    """Raise InputError for a motion between two rests that the sensors cannot have measured."""
    if found.tilt_left_deg > MAX_TILT_DEG:
        raise InputError(
            path,
            f"gravity at the end's rest is {found.tilt_left_deg:.1f} deg off the vertical that the gyroscope carried "
            f"there; allowed: {MAX_TILT_DEG:g}",
            remedy=HOLD,
        )
    if found.velocity_left_m_s > MAX_VELOCITY_LEFT_M_S:
        raise InputError(
            path,
            f"{found.velocity_left_m_s:.2f} m/s are left at the end's rest; allowed: {MAX_VELOCITY_LEFT_M_S:g}",
            remedy=HOLD,
        )


def report(motions: Sequence[Motion], rate_hz: float) -> list[str]:
    """Return the line about what a swing's path can be worth, of its worst motion."""
    if not motions:
        return []
    worst = max((one.evidence for one in motions), key=lambda one: one.likely_m)
    return [
        f"from inertial sensors at {rate_hz:.0f} Hz: {worst.duration_s:.1f} s between rests of {worst.rests_s[0]:.1f} "
        f"and {worst.rests_s[1]:.1f} s, turned by up to {worst.turn_deg:.0f} deg; {worst.velocity_left_m_s:.2f} m/s "
        f"and {worst.tilt_left_deg:.1f} deg were left at the end before the correction: error likely "
        f"{1e3 * worst.expected_m:.0f} mm rms (sensors as assumed) to {1e3 * worst.likely_m:.0f} mm (as recordings of "
        f"others with such a velocity), {worst.lean_error_deg:.1f} deg of lean; neither is a bound; {UNSEEN}"
    ]


def suspicions(motions: Sequence[Motion], signals: Signals) -> list[str]:
    """Return doubts about a swing of these motions, each with what to do; raises InputError at a long gap."""
    doubts = []
    for motion in motions:
        doubts += [line for worse, line in _doubts(motion.evidence) if worse]
        begin_s, end_s = signals.t_s[motion.start], signals.t_s[motion.end]
        for sensor, limit, unit, name in (
            (signals.accelerometer, FAST_M_S2, "m/s^2", "accelerometer"),
            (signals.gyroscope, FAST_RAD_S, "rad/s", "gyroscope"),
        ):
            chosen = (sensor.t_s >= begin_s) & (sensor.t_s <= end_s)
            values, steps = sensor.values[chosen], np.diff(sensor.t_s[chosen])
            _check_gaps(sensor.path, name, sensor.t_s[chosen] - signals.t_s[0], signals.max_gap_s)
            if steps.size and steps.max() > 2.5 * np.median(steps):
                doubts.append(f"the {name} has gaps of up to {1e3 * steps.max():.0f} ms: choose a lower rate")
            if (flat := flat_top(values)) is not None:
                doubts.append(f"the {name} stays at its limit of {flat:.0f} {unit}, clipped: swing more gently")
            elif (peak := float(np.linalg.norm(values, axis=1).max(initial=0.0))) > limit:
                doubts.append(f"the {name} peaks at {peak:.0f} {unit}, where its scale weighs: swing more gently")
    return list(dict.fromkeys(doubts))


def check_pauses(signals: Signals) -> None:
    """Raise InputError where a sensor pauses for longer than a rest bears, or its clock was set ahead."""
    for sensor, name in ((signals.accelerometer, "accelerometer"), (signals.gyroscope, "gyroscope")):
        _check_gaps(sensor.path, name, sensor.t_s - signals.t_s[0], max(MAX_PAUSE_S, signals.max_gap_s))


def _check_gaps(path: str, name: str, t_s: Array, allowed_s: float) -> None:
    gap_s = np.diff(t_s).max(initial=0.0)
    if gap_s > allowed_s:
        raise InputError(
            path,
            f"no sample of the {name} for {1e3 * gap_s:.0f} ms; allowed: {1e3 * allowed_s:.0f}",
            where=f"{t_s[np.diff(t_s).argmax()]:.2f} s",
            remedy="close other apps or choose a lower rate, record again, or raise capture.max_gap_s",
        )


def flat_top(values: Array) -> float | None:
    """Return the value at which an axis of samples (n, 3) stays for three samples at its extreme; None for none."""
    for axis in values.T:
        peak = float(np.abs(axis).max(initial=0.0))
        top = np.abs(axis) >= peak * (1 - FLAT_FRACTION)
        if (
            peak > 0.5 * float(np.abs(values).max())
            and peak > 5.0
            and np.convolve(top, np.ones(FLAT_SAMPLES), "valid").max(initial=0) >= FLAT_SAMPLES
        ):
            return peak
    return None


def _doubts(found: Evidence) -> list[tuple[bool, str]]:
    return [
        (found.duration_s > LONG_S, f"the motion takes {found.duration_s:.1f} s; errors grow fast beyond {LONG_S:g} s"),
        (min(found.rests_s) < SHORT_REST_S, f"a rest of {min(found.rests_s):.1f} s only: hold still for a second"),
        (found.tilt_left_deg > GOOD_TILT_DEG, f"{found.tilt_left_deg:.1f} deg of tilt left; good is below 0.5: {HOLD}"),
        (
            found.force_change_m_s2 > MAX_FORCE_CHANGE_M_S2 or found.rate_change_deg_s > MAX_RATE_CHANGE_DEG_S,
            f"the rests differ by {found.force_change_m_s2:.2f} m/s^2 and {found.rate_change_deg_s:.1f} deg/s: one of "
            "them was no rest; hold still",
        ),
        (found.turn_deg > GREAT_TURN_DEG, f"it turns by {found.turn_deg:.0f} deg; errors grow with it: lean less"),
        (found.likely_m > POOR_M, f"the path is poor (up to {1e3 * found.likely_m:.0f} mm likely): {HOLD}"),
    ]
