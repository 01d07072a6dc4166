"""Reading every body and marker of a recording, whatever wrote it: one table for the hand and for thrown balls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.c3d import read_c3d
from kendama_cli.devices.recordings.mcap_poses import read_mcap_bodies
from kendama_cli.devices.recordings.recording_format import (
    BAG,
    C3D,
    MCAP,
    MOTIVE,
    QUALISYS,
    STREAM,
    TRC,
    VICON,
    RecordingFormat,
    format_of,
    text_of,
)
from kendama_cli.devices.recordings.rosbag import read_bag
from kendama_cli.devices.recordings.table import read_motive, read_qualisys, read_table, read_trc, read_vicon
from kendama_cli.devices.streams.stream_file import read_stream

KNOWN = (
    "give a CSV with the columns t_s,x_m,y_m,z_m, a Qualisys TSV, a Motive or Vicon CSV, a TRC, a C3D, a ROS bag, or "
    "an MCAP with transforms"
)

OF_TEXT: Mapping[RecordingFormat, Callable[[str, str], list[BodyTrack]]] = {
    MOTIVE: read_motive,
    QUALISYS: read_qualisys,
    STREAM: lambda path, text: [read_stream(path, text)],
    TRC: read_trc,
    VICON: read_vicon,
}
"""Readers of text; any other is a plain table."""


def read_bodies(path: str) -> list[BodyTrack]:
    """Return every body and marker in the file; raises InputError for one of no known kind, or damaged."""
    file = Path(path)
    form = format_of(file, remedy=KNOWN)
    if form is BAG:
        return read_bag(file)
    if form is MCAP:
        return read_mcap_bodies(path)
    if form is C3D:
        return read_c3d(path, file.read_bytes())
    return OF_TEXT.get(form, read_table)(path, text_of(path, file.read_bytes(), remedy=KNOWN))
