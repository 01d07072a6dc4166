"""Reading every body and marker of a recording, whatever wrote it: one table for the hand and for thrown balls."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from kendama_cli.devices.recordings.body_track import BodyTrack
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
    text_of,
)
from kendama_cli.plugins.shared.recordings.bag import read_bag
from kendama_cli.plugins.shared.recordings.table import read_table
from kendama_cli.plugins.shared.streams.stream_file import read_stream
from kendama_cli.schema.registry import brought
from kendama_cli.schema.units import LengthUnit

KNOWN = (
    "give a CSV with the columns t_s,x_m,y_m,z_m, a Qualisys TSV, a Motive or Vicon CSV, a TRC, a BVH, a C3D, a ROS "
    "bag, an MCAP with transforms, a Parquet table or an npz"
)
RECORDINGS = "kendama.recordings"
"""Entry point group of readers, called with a path and the unit of a file that tells none."""
BROUGHT: Mapping[RecordingFormat, str] = {
    BVH: "bvh",
    C3D: "c3d",
    MOTIVE: "motive",
    QUALISYS: "qualisys",
    TRC: "trc",
    VICON: "vicon",
}
"""Names in it of the formats that a part reads."""


def read_bodies(path: str, unit: LengthUnit | None = None) -> list[BodyTrack]:
    """Return every body and marker in the file; raises InputError for one of no known kind, or damaged.

    ``unit`` is that of a file which tells none, as BVH does not. Raises MissingPartError where a part reads it.
    """
    file = Path(path)
    form = format_of(file, remedy=KNOWN)
    if form in BROUGHT:
        found: list[BodyTrack] = brought(f"{path}: {form.name}", RECORDINGS, BROUGHT[form])(path, unit)
        return found
    if form is BAG:
        return read_bag(file)
    if form is MCAP:
        return read_mcap_bodies(path)
    if form in (PARQUET, NPZ):
        return [track for text in columnar_texts(path, form) for track in read_table(path, text)]
    text = text_of(path, file.read_bytes(), remedy=KNOWN)
    return [read_stream(path, text)] if form is STREAM else read_table(path, text)
