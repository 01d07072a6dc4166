"""Reading every body and marker of a recording, whatever wrote it: one table for the hand and for thrown balls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

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
from kendama_cli.devices.recordings.text_table import filled_rows, numbers
from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.recordings.bag import read_bag
from kendama_cli.plugins.shared.streams.stream_file import read_stream
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.registry import brought
from kendama_cli.schema.units import LengthUnit

COLUMNS = ("t_s", "x_m", "y_m", "z_m")
ROTATION = ("qw", "qx", "qy", "qz")
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


def read_table(path: str, text: str) -> list[BodyTrack]:
    """Return the one track of a table whose head names the columns t_s, x_m, y_m and z_m, in any order among others.

    With qw, qx, qy and qz it is a body with orientation. Raises InputError where a column is missing.
    """
    rows = [row for row in filled_rows(text) if not row.cells[0].startswith("#")]
    header = [cell.lower() for cell in rows[0].cells] if rows else []
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        listed = ", ".join(name for name in header if name)[:120] or "nothing"
        problem = f"its header lacks {', '.join(missing)}; it has {listed}"
        remedy = "name the columns t_s,x_m,y_m,z_m in the first line (seconds and metres)"
        raise InputError(path, problem, where=f"line {rows[0].line if rows else 1}", remedy=remedy)
    names = (*COLUMNS, *(ROTATION if set(ROTATION) <= set(header) else ()))
    values = numbers(path, rows[1:], [header.index(name) for name in names], names)
    return [BodyTrack("ball", values[:, 0], values[:, 1:4], values[:, 4:] if len(names) > 4 else None)]


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


@dataclass(frozen=True)
class RecordedTrack:
    """One recorded point: times ``t_s`` (n,), rising, and ``position_m`` (n, 3), nan where it was not seen.

    So many samples were left out as ``repeated``: they had the time of the one before.
    """

    name: str
    t_s: Array
    position_m: Array
    repeated: int = 0


def read_tracks(path: Path) -> list[RecordedTrack]:
    """Return every point's track; raises InputError for an unknown or damaged file, and where time does not rise."""
    tracks = [_once(RecordedTrack(one.name, one.t_s, one.position_m)) for one in read_bodies(str(path))]
    for track in tracks:
        wrong = np.flatnonzero(~(np.diff(track.t_s) > 0))
        if len(wrong):
            i = int(wrong[0])
            problem = f"time does not rise: {track.t_s[i + 1]:.6g} s after {track.t_s[i]:.6g} s"
            remedy = "sort the samples, and give every one a time"
            raise InputError(str(path), problem, where=f"sample {i + 2} of '{track.name}'", remedy=remedy)
    return tracks


def _once(track: RecordedTrack) -> RecordedTrack:
    """Remove samples that have the time of the one before."""
    new = np.concatenate([[True], np.diff(track.t_s) != 0])[: len(track.t_s)]
    return RecordedTrack(track.name, track.t_s[new], track.position_m[new], int((~new).sum()))
