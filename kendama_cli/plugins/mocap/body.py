"""A hand that a motion capture system recorded: a body of a file in our axes, and the ball if it is there.

The ball tells which way is down, and which swings ended in a catch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kendama_cli.devices.demonstrator.axes import determinant, mirror_problem, to_ours
from kendama_cli.devices.demonstrator.file import RecordedDemonstrator, hands_of
from kendama_cli.devices.demonstrator.recording import Recording, unit_rotations
from kendama_cli.devices.demonstrator.segments import checked_swings
from kendama_cli.devices.demonstrator.tidy import tidied
from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.recording_format import name_of
from kendama_cli.errors import InputError
from kendama_cli.motion.rotation import mapped, rotated
from kendama_cli.plugins.mocap.settings import BodyCapture, BodySettings
from kendama_cli.plugins.shared.recordings.reader import read_bodies
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import count_of

REST_S = 0.15
LONGEST_M = 0.8
"""A ball farther from the cup than this does not hang from it."""
SHORTEST_M = 0.15
"""A ball nearer lies in the cup or the hand."""
STILL_M_S = 0.15
LEAN_DEG = 25.0
CAUGHT_SHARE = 0.5
"""At the end the ball is above where it hung by more than this share of the hanging length, and stays."""


def open_bodies(settings: BodyCapture) -> Sequence[RecordedDemonstrator]:
    """Open a demonstrator for every swing of the body in every file; raises InputError for a file that lacks it."""
    recordings: list[Recording] = []
    for path in (settings.path,) if isinstance(settings.path, str) else settings.path or ():
        tracks = {one.name: one for one in read_bodies(path, settings.unit)}
        body = named_body(path, tracks, settings.body, "body")
        ball = None if settings.ball is None else named_body(path, tracks, settings.ball, "ball")
        recording = recording_of(path, body, ball, settings)
        if recording.ball_m is not None:
            check_gravity(recording)
        swings = checked_swings(recording, settings.plausible, math.inf, settings.segments)
        recordings += without_misses(swings) if settings.misses == "drop" else swings
    return hands_of(recordings)


def recording_of(path: str, body: BodyTrack, ball: BodyTrack | None, settings: BodySettings) -> Recording:
    """Return the cup's motion by ``body`` in our axes; raises InputError if it is not seen for too long."""
    seen = np.isfinite(body.position_m).all(axis=1)
    if body.rotation_wxyz is not None:
        seen &= np.isfinite(body.rotation_wxyz).all(axis=1)
    if ball is not None:
        seen &= np.isin(body.t_s, ball.t_s)
    known = np.flatnonzero(seen)
    if len(known) < 2:
        raise InputError(
            path, f"'{body.name}' is seen in {count_of(len(known), 'sample')}", remedy="record the swing again"
        )
    stamps_s = body.t_s[known]
    turn, mirror = np.array(to_ours(settings.axes)), determinant(settings.axes)
    place_m = body.position_m[known] @ turn.T
    turned = None
    if body.rotation_wxyz is not None:
        if problem := mirror_problem(mirror, settings.handedness):
            raise InputError(path, f"capture.axes is {list(settings.axes)}, which {problem}")
        turned = mapped(body.rotation_wxyz[known], turn, mirror)
        place_m = place_m + rotated(turned, turn @ np.asarray(settings.body_to_cup_m))
    elif any(settings.body_to_cup_m):
        problem = f"'{body.name}' has no orientation, so capture.body_to_cup_m cannot be applied"
        raise InputError(path, problem, remedy="give a rigid body, or set capture.body_to_cup_m=[0,0,0]")

    def place(sample: int) -> str:
        return f"{body.name} at {stamps_s[sample]:.3f} s"

    recording = Recording(
        path,
        name_of(path),
        stamps_s - stamps_s[0],
        place_m,
        place,
        "look at the unit in which it was exported",
        "look at capture.axes (z points up, x lies in the swing's plane)",
        rotation_wxyz=None
        if turned is None
        else unit_rotations(path, turned, place, from_start=settings.upright == "start"),
        ball_m=None if ball is None else _at(ball, stamps_s) @ turn.T,
    )
    recording = tidied(recording, settings.times)
    _check_gaps(body.name, settings, recording)
    return recording


def _at(ball: BodyTrack, t_s: Array) -> Array:
    """Return the ball's positions (n, 3) at ``t_s`` (n,); NaN where it was not seen."""
    return np.asarray(ball.position_m[np.searchsorted(ball.t_s, t_s)])


def named_body(path: str, tracks: dict[str, BodyTrack], name: str | None, key: str) -> BodyTrack:
    """Return the track that ``capture.<key>`` names (its child frame alone will do if unique), or the only one.

    Raises InputError with those that are there.
    """
    if name is None and len(tracks) == 1:
        return next(iter(tracks.values()))
    ending = [one for one in tracks if name and one.endswith(f" {name}")]
    if name not in tracks and len(ending) == 1:  # a child frame, whatever its topic
        return tracks[ending[0]]
    if name not in tracks:
        listed = ", ".join(f"'{one}'" for one in list(tracks)[:20])
        problem = f"no '{name}'" if name is not None else f"{len(tracks)} bodies and markers"
        raise InputError(path, f"{problem}; it has {listed}", remedy=f"set capture.{key} to one of them")
    return tracks[name]


def _check_gaps(name: str, settings: BodySettings, recording: Recording) -> None:
    steps = np.diff(recording.t_s)
    worst = int(steps.argmax())
    if steps[worst] > max(settings.max_gap_s, 2.5 * float(np.median(steps))):
        raise InputError(
            recording.path,
            f"'{name}' is not seen for {steps[worst]:.3g} s; allowed: {settings.max_gap_s:g} s",
            where=f"{recording.t_s[worst]:.3f} s",
            remedy="fill the gap in the capture program, cut the recording, or raise capture.max_gap_s",
        )


def check_gravity(recording: Recording) -> None:
    """Raise InputError where the ball at rest does not hang below the cup: then z does not point up."""
    hang = _hanging(recording)
    if hang is None:
        return
    lean = float(np.degrees(np.arccos(np.clip(-hang[2] / np.linalg.norm(hang), -1, 1))))
    if lean > LEAN_DEG:
        axis = int(np.abs(hang).argmax())
        name, sign = "xyz"[axis], "+-"[int(hang[axis] < 0)]
        up = f"-{name}" if sign == "+" else name
        raise InputError(
            recording.path,
            f"the ball hangs at rest {np.linalg.norm(hang):.2f} m toward {sign}{name}, {lean:.0f} deg from -z: "
            f"{up} points up, not z",
            remedy=recording.axes_remedy,
        )


def without_misses(swings: list[Recording]) -> list[Recording]:
    """Return the swings that ended in a catch, if the ball shows it; all of them, with a warning, if none did."""
    judged = [(swing, _caught(swing)) for swing in swings]
    missed = [swing.name for swing, caught in judged if caught is False]
    kept = [swing for swing, caught in judged if caught is not False]
    if not missed:
        return swings
    names = ", ".join(missed)
    if not kept:
        first = replace(swings[0], warnings=(*swings[0].warnings, f"the ball was caught in none of: {names}"))
        return [first, *swings[1:]]
    warning = f"left out, the ball was not caught: {names} (capture.misses=keep)"
    return [replace(kept[0], warnings=(warning, *kept[0].warnings)), *kept[1:]]


def _hanging(recording: Recording) -> Array | None:
    """Return the vector (3,) from the cup to the ball at rest at the start; None if they move, or the ball is held."""
    if recording.ball_m is None:
        return None
    first = recording.t_s <= REST_S
    away = (recording.ball_m - recording.position_m)[first]
    away = away[np.isfinite(away).all(axis=1)]
    if len(away) < 3:
        return None
    middle = np.median(away, axis=0)
    far = float(np.linalg.norm(middle))
    moving = float(np.linalg.norm(away[-1] - away[0])) / REST_S
    return middle if SHORTEST_M < far < LONGEST_M and moving < STILL_M_S else None


def _caught(recording: Recording) -> bool | None:
    """Return True if the ball ended in the cup, False if not; None if the recording does not show it."""
    hang = _hanging(recording)
    if hang is None or recording.ball_m is None:
        return None
    last = recording.t_s >= recording.t_s[-1] - REST_S
    away = (recording.ball_m - recording.position_m)[last]
    away = away[np.isfinite(away).all(axis=1)]
    if len(away) < 3:
        return None
    return bool((away[:, 2] > hang[2] + CAUGHT_SHARE * np.linalg.norm(hang)).all())
