"""Swings of a phone's recording: sensors on one clock, cut at the rests, each in its own plane, with its evidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.devices.demonstrator.file import RecordedDemonstrator, hands_of
from kendama_cli.devices.demonstrator.recording import MAX_SAMPLES, Recording
from kendama_cli.devices.demonstrator.segments import checked_swings
from kendama_cli.devices.demonstrator.swing_axes import check_axes
from kendama_cli.errors import InputError
from kendama_cli.motion.rotation import exponential, inverse, mapped, matrix_of, multiply, rotated
from kendama_cli.plugins.phone.estimate import Motion, motion_between
from kendama_cli.plugins.phone.evidence import Signals, check_motion, check_pauses, check_rests, report, suspicions
from kendama_cli.plugins.phone.files import Export, read_exports
from kendama_cli.plugins.phone.rests import find_rests
from kendama_cli.plugins.phone.settings import PhoneCapture
from kendama_cli.plugins.phone.strapdown import sampled
from kendama_cli.plugins.phone.tables import WITH_GRAVITY, Signal, gravity_sign, recordings_in, signals_of
from kendama_cli.schema.arrays import Array

STANDARD_GRAVITY_M_S2 = 9.80665
IN_G, IN_M_S2 = (0.8, 1.3), (9.2, 10.4)
WITHOUT_M_S2, MAX_USUAL_M_S2 = 0.5, 50.0
GRAVITY = "gravity is 9.8 m/s^2, or 1 g"
KNOWN_UNIT = "export it in m/s^2 or g"
MOVING_M_S, MOVING_M_S2 = 0.15, 0.08
"""A quiet stretch is a rest unless the velocity there is more than sensors can pretend, which grows with the time."""


@dataclass(frozen=True)
class Reconstruction:
    """A whole recording as one path that rests between its motions; ``motions`` refer to its samples."""

    recording: Recording
    motions: tuple[Motion, ...]
    signals: Signals


def open_phone(settings: PhoneCapture) -> Sequence[RecordedDemonstrator]:
    """Open a demonstrator for every swing in every recording; raises InputError for what cannot be a swing."""
    paths = (settings.path,) if isinstance(settings.path, str) else settings.path or ()
    return hands_of(
        [
            swing
            for export in read_exports(paths)
            for one in recordings_in(export, settings)
            for swing in swings_of(one, settings)
        ]
    )


def swings_of(export: Export, settings: PhoneCapture) -> list[Recording]:
    """Return the swings of one export, each turned into its plane, with its evidence among the warnings."""
    whole = reconstructed(export, settings)
    loose = replace(settings.plausible, axes="off")  # judged below, in each swing's own plane
    swings = []
    for swing in checked_swings(whole.recording, loose, math.inf, settings.segments):
        first = _first_sample(whole.recording.position_m, swing.position_m)
        last = first + len(swing.t_s) - 1
        motions = [one for one in whole.motions if one.start < last and one.end > first]
        for motion in motions:
            check_motion(export.path, motion.evidence)
        own = in_own_plane(swing, settings.sensor_in_cup_m)
        lines = [*report(motions, whole.signals.rate_hz), *suspicions(motions, whole.signals)]
        lines += check_axes(own, settings.plausible.axes)
        swings.append(
            replace(
                own,
                likely_error_m=max((one.evidence.likely_m for one in motions), default=None),
                warnings=(*swing.warnings, *(f"{swing.name}: {one}" for one in lines)),
            )
        )
    return swings


def reconstructed(export: Export, settings: PhoneCapture) -> Reconstruction:
    """Return the path of the sensor over the whole recording.

    Raises InputError where rests are missing or short, samples are missing, or the acceleration is not that of gravity.
    """
    force, rate = signals_of(export, settings)
    sign = gravity_sign(export, settings)
    signed = replace(force, values=sign * force.values)
    return reconstructed_from(export.path, export.name, on_one_clock(export.path, signed, rate, settings.max_gap_s))


def reconstructed_from(path: str, name: str, signals: Signals) -> Reconstruction:
    """Return the path of the sensor over ``signals``, called ``name`` and of the file ``path`` in errors."""
    t_s, force, rate = signals.t_s, signals.force(signals.t_s), signals.rate(signals.t_s)
    check_pauses(signals)
    quiet = find_rests(signals.step_s, force, rate)
    check_rests(path, quiet, len(t_s), signals.step_s)
    _check_gravity(signals.accelerometer.path, force[quiet[0].first : quiet[0].last + 1])
    samples = sampled(t_s, signals.force, signals.rate)
    motions, before = [], quiet[0]
    for after in quiet[1:]:
        motion = motion_between(samples, before, after)
        found = motion.evidence
        if after is not quiet[-1] and found.velocity_left_m_s > MOVING_M_S + MOVING_M_S2 * found.duration_s:
            continue  # a steady motion, not a rest
        motions.append(motion)
        before = after
    position, rotation = _joined(len(t_s), motions)
    recording = Recording(
        path,
        name,
        t_s - t_s[0],
        position,
        lambda sample: f"{t_s[sample] - t_s[0]:.2f} s",
        "hold the phone still for a second before and after one swing of less than two seconds, and record again",
        "the vertical comes from gravity at rest: hold the phone still for a second before the swing",
        rotation_wxyz=rotation,
    )
    return Reconstruction(recording, tuple(motions), signals)


def in_own_plane(swing: Recording, sensor_in_cup_m: Sequence[float], right: Array | None = None) -> Recording:
    """Return the cup's path with x along its largest level extent, and its rotation from the upright cup at the start.

    The sensor's path is p + R r, with the sensor at r in the cup. Gravity does not show the heading; the principal
    direction of the path stands for it, pointing to where the path goes farthest, or along ``right`` (2,).
    """
    assert swing.rotation_wxyz is not None
    turned = multiply(swing.rotation_wxyz, inverse(swing.rotation_wxyz[0]))
    level = swing.position_m[:, :2] - swing.position_m[:, :2].mean(axis=0)
    along = np.linalg.svd(level, full_matrices=False)[2][0]
    ahead = float((level @ along)[np.abs(level @ along).argmax()]) if right is None else float(right @ along)
    along *= math.copysign(1.0, ahead)
    heading = matrix_of(exponential(np.array([0.0, 0.0, -math.atan2(along[1], along[0])])))
    rotation = mapped(turned, heading, 1)
    offset = rotated(rotation, np.asarray(sensor_in_cup_m, dtype=np.float64))
    return replace(swing, position_m=swing.position_m @ heading.T - offset, rotation_wxyz=rotation)


def on_one_clock(path: str, force: Signal, rate: Signal, max_gap_s: float) -> Signals:
    """Return splines of both sensors over the time that both cover, and even times at the accelerometer's rate."""
    begin_s, end_s = max(force.t_s[0], rate.t_s[0]), min(force.t_s[-1], rate.t_s[-1])
    step_s = min(float(np.median(np.diff(one.t_s))) for one in (force, rate))
    count = int((end_s - begin_s) / step_s + 1e-6) + 1
    if count < 20:
        raise InputError(
            path,
            f"accelerometer and gyroscope overlap for {max(end_s - begin_s, 0):.2f} s",
            remedy="give two files of one recording, with stamps of one clock",
        )
    if count > MAX_SAMPLES:
        raise InputError(path, f"{end_s - begin_s:.0f} s; that is a whole session", remedy="cut it to the swings")
    usual = float(np.median(np.linalg.norm(force.values, axis=1)))
    if usual > MAX_USUAL_M_S2:
        raise InputError(force.path, f"the acceleration is {usual:.4g} in the median; {GRAVITY}", remedy=KNOWN_UNIT)
    unit = STANDARD_GRAVITY_M_S2 if IN_G[0] <= usual <= IN_G[1] else 1.0
    force = replace(force, values=unit * force.values)
    rate = replace(rate, values=rate.values * (math.pi / 180 if rate.unit == "deg" else 1.0))
    even_s = begin_s + step_s * np.arange(count)
    splines = CubicSpline(force.t_s, force.values), CubicSpline(rate.t_s, rate.values)
    return Signals(even_s, *splines, force, rate, max_gap_s)


def _check_gravity(path: str, at_rest: Array) -> None:
    """Raise InputError unless the accelerometer's values (n, 3) at rest have gravity's size."""
    size = float(np.linalg.norm(at_rest.mean(axis=0)))
    if IN_M_S2[0] <= size <= IN_M_S2[1]:
        return
    problem = f"the acceleration at rest is {size:.2f}; {GRAVITY}"
    if size < WITHOUT_M_S2:
        raise InputError(path, f"{problem}: it is without gravity", remedy=WITH_GRAVITY)
    raise InputError(path, problem, remedy="hold the phone still for a second before the swing, and record it again")


def _joined(count: int, motions: Sequence[Motion]) -> tuple[Array, Array]:
    """Return position (n, 3) and rotation (n, 4) over all samples; each motion continues from the one before."""
    position, rotation = np.zeros((count, 3)), np.tile(motions[0].rotation_wxyz[0], (count, 1))
    for motion in motions:
        part = slice(motion.first, motion.last + 1)
        offset = multiply(rotation[motion.first], inverse(motion.rotation_wxyz[0]))
        heading = offset * [1.0, 0.0, 0.0, 1.0]  # the turn about z in it: the rest is the drift of the lean
        heading /= np.linalg.norm(heading)
        position[part] = position[motion.first] + motion.position_m @ matrix_of(heading).T
        rotation[part] = multiply(heading, motion.rotation_wxyz)
        position[motion.last :], rotation[motion.last :] = position[motion.last], rotation[motion.last]
    return position, rotation


def _first_sample(whole_m: Array, part_m: Array) -> int:
    """Return the sample of the whole path with which a part begins, by its fastest sample, which is there once."""
    fastest = int(np.linalg.norm(np.diff(part_m, axis=0), axis=1).argmax())
    return int(np.flatnonzero((whole_m == part_m[fastest]).all(axis=1))[0]) - fastest
