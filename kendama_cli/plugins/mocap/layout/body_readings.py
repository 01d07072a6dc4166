"""Readings of a file of bodies and markers: each of them, in each unit where the file tells none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.recording_format import BVH, RecordingFormat
from kendama_cli.errors import InputError
from kendama_cli.plugins.mocap.layout.reading import AxisMap, Finding, Reading, rank_of
from kendama_cli.plugins.shared.recordings.reader import read_bodies
from kendama_cli.schema.units import METRES, LengthUnit

SEEN = 0.5
"""A body or marker that is seen in less of the frames is not the cup."""


def body_readings(path: str, form: RecordingFormat) -> list[Reading]:
    """Return the readings of a recording of bodies; raises InputError where none is seen for long enough."""
    units: tuple[LengthUnit | None, ...] = tuple(METRES) if form is BVH else (None,)
    tracks = [(unit, track) for unit in units for track in read_bodies(path, unit)]
    seen = [(unit, track) for unit, track in tracks if np.isfinite(track.position_m).all(axis=1).mean() >= SEEN]
    if not seen:
        problem = f"none of its {len(tracks)} bodies and markers is seen in half of the frames"
        raise InputError(path, problem, remedy="record it again, or fill the gaps in the capture program")
    return [_reading(path, form, track, unit, len(tracks) // len(units)) for unit, track in seen]


def _reading(path: str, form: RecordingFormat, track: BodyTrack, unit: LengthUnit | None, count: int) -> Reading:
    known = np.isfinite(track.position_m).all(axis=1)
    t_s = track.t_s[known] - track.t_s[known][0]
    rate_hz = (len(t_s) - 1) / max(float(t_s[-1]), 1e-9)
    turned = "with its orientation" if track.rotation_wxyz is not None else "a marker: no orientation"
    findings = (
        Finding("time", f"{rate_hz:.4g} Hz", f"{len(t_s)} frames of {form.name}"),
        Finding("body", track.name, f"one of {count}; {turned}; seen in {known.mean():.0%} of the frames"),
        Finding(
            "unit", unit or "m", f"{form.name} tells none: a guess by the ball" if unit else "the file says its unit"
        ),
    )
    settings = _settings(path, track.name if count > 1 else None, unit)
    places = track.position_m[known]
    return Reading(
        track.name, t_s, places, ("x", "y", "z"), findings, settings, rank_of(track.name), guessed=unit or ""
    )


def _settings(path: str, body: str | None, unit: LengthUnit | None) -> Callable[[AxisMap], Mapping[str, Any]]:
    def settings(axes: AxisMap) -> Mapping[str, Any]:
        made: dict[str, Any] = {"kind": "body", "path": path}
        made |= {"body": body} if body else {}
        made |= {"unit": unit} if unit else {}
        return made | {"axes": [("-" if sign < 0 else "") + "xyz"[i] for i, sign in axes]}

    return settings
