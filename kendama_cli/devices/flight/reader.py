"""Recorded tracks of points from files of any known kind, told apart by what is in them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from kendama_cli.devices.flight.c3d import read_c3d
from kendama_cli.devices.flight.mcap_tracks import read_mcap_tracks
from kendama_cli.devices.flight.motive import read_motive
from kendama_cli.devices.flight.qualisys import read_qualisys
from kendama_cli.devices.flight.table import checked, read_table
from kendama_cli.devices.recording_format import (
    C3D,
    MCAP,
    MOTIVE,
    QUALISYS,
    QUALISYS_6D,
    RecordingFormat,
    format_of,
    text_of,
)
from kendama_cli.vision.flight_search import RecordedTrack

KNOWN = "give a CSV with the columns t_s,x_m,y_m,z_m, a Qualisys TSV, a Motive CSV, a C3D, or an MCAP with transforms"

OF_TEXT: Mapping[RecordingFormat, Callable[[str, str], list[RecordedTrack]]] = {
    QUALISYS: read_qualisys,
    QUALISYS_6D: read_qualisys,
    MOTIVE: read_motive,
}
"""What reads which text; any other is a plain table."""


def read_tracks(path: Path) -> list[RecordedTrack]:
    """Every point's track in the file; raises InputError for a file that is none of the known kinds, or damaged."""
    name, form = str(path), format_of(path, remedy=KNOWN)
    if form is MCAP:
        tracks = read_mcap_tracks(path)
    elif form is C3D:
        tracks = read_c3d(name, path.read_bytes())
    else:
        tracks = OF_TEXT.get(form, read_table)(name, text_of(name, path.read_bytes(), remedy=KNOWN))
    return [checked(name, track) for track in tracks]
