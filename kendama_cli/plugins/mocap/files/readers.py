"""Readers for the entry point group ``kendama.recordings``: of a path, and a unit where the file tells none."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.recording_format import layout_command, text_of
from kendama_cli.errors import InputError
from kendama_cli.plugins.mocap.files.bvh import read_bvh
from kendama_cli.plugins.mocap.files.c3d import read_c3d
from kendama_cli.plugins.mocap.files.exports import read_motive, read_qualisys, read_trc, read_vicon
from kendama_cli.plugins.shared.recordings.reader import KNOWN
from kendama_cli.schema.units import METRES, LengthUnit


def bvh(path: str, unit: LengthUnit | None) -> list[BodyTrack]:
    """Read the joints of a BVH; raises InputError without ``unit``."""
    if unit is None:
        raise InputError(path, "a BVH does not tell its unit", remedy=f"type: {layout_command(path)}")
    return read_bvh(path, _text(path), METRES[unit])


def c3d(path: str, unit: LengthUnit | None) -> list[BodyTrack]:
    """Read the points of a C3D."""
    return read_c3d(path, Path(path).read_bytes())


def motive(path: str, unit: LengthUnit | None) -> list[BodyTrack]:
    """Read the bodies and markers of Motive's CSV."""
    return read_motive(path, _text(path))


def qualisys(path: str, unit: LengthUnit | None) -> list[BodyTrack]:
    """Read the bodies or markers of a Qualisys TSV."""
    return read_qualisys(path, _text(path))


def trc(path: str, unit: LengthUnit | None) -> list[BodyTrack]:
    """Read the markers of a TRC."""
    return read_trc(path, _text(path))


def vicon(path: str, unit: LengthUnit | None) -> list[BodyTrack]:
    """Read the markers of Vicon Nexus' CSV."""
    return read_vicon(path, _text(path))


def _text(path: str) -> str:
    return text_of(path, Path(path).read_bytes(), remedy=KNOWN)
