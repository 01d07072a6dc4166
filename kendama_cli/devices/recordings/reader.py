"""Reading every body and marker of a recording, whatever wrote it: one table for the hand and for thrown balls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.bvh import read_bvh
from kendama_cli.devices.recordings.c3d import read_c3d
from kendama_cli.devices.recordings.columnar import columnar_texts
from kendama_cli.devices.recordings.mcap_poses import read_mcap_bodies
from kendama_cli.devices.recordings.recording_format import (
    BAG,
    BVH,
    C3D,
    MCAP,
    MOTIVE,
    NPZ,
    PARQUET,
    QUALISYS,
    STREAM,
    TRC,
    VICON,
    RecordingFormat,
    format_of,
    layout_command,
    text_of,
)
from kendama_cli.devices.recordings.rosbag import read_bag
from kendama_cli.devices.recordings.table import read_motive, read_qualisys, read_table, read_trc, read_vicon
from kendama_cli.devices.streams.stream_file import read_stream
from kendama_cli.errors import InputError
from kendama_cli.schema.units import METRES, LengthUnit

KNOWN = (
    "give a CSV with the columns t_s,x_m,y_m,z_m, a Qualisys TSV, a Motive or Vicon CSV, a TRC, a BVH, a C3D, a ROS "
    "bag, an MCAP with transforms, a Parquet table or an npz"
)

OF_TEXT: Mapping[RecordingFormat, Callable[[str, str], list[BodyTrack]]] = {
    MOTIVE: read_motive,
    QUALISYS: read_qualisys,
    STREAM: lambda path, text: [read_stream(path, text)],
    TRC: read_trc,
    VICON: read_vicon,
}
"""Readers of text; any other is a plain table."""


def read_bodies(path: str, unit: LengthUnit | None = None) -> list[BodyTrack]:
    """Return every body and marker in the file; raises InputError for one of no known kind, or damaged.

    ``unit`` is that of a file which tells none, as BVH does not.
    """
    file = Path(path)
    form = format_of(file, remedy=KNOWN)
    if form is BAG:
        return read_bag(file)
    if form is MCAP:
        return read_mcap_bodies(path)
    if form is C3D:
        return read_c3d(path, file.read_bytes())
    if form in (PARQUET, NPZ):
        return [track for text in columnar_texts(path, form) for track in read_table(path, text)]
    if form is BVH:
        if unit is None:
            raise InputError(path, "a BVH does not tell its unit", remedy=f"type: {layout_command(path)}")
        return read_bvh(path, text_of(path, file.read_bytes(), remedy=KNOWN), METRES[unit])
    return OF_TEXT.get(form, read_table)(path, text_of(path, file.read_bytes(), remedy=KNOWN))
