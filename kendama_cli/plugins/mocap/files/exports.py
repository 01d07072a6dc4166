"""Tracks from exports of text: TRC, Vicon, Motive and Qualisys."""

from __future__ import annotations

import re

import numpy as np
from scipy.spatial.transform import Rotation

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.text_table import Row, filled_rows, is_value, number, numbers
from kendama_cli.errors import InputError
from kendama_cli.motion.rotation import exponential, log_of
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import METRES, LengthUnit, length_unit

MOTIVE_REMEDY = "export it again from Motive as CSV with header information and positions"
MOTIVE_EULER = re.compile(r"[XYZ]{3}")
QUALISYS_REMEDY = "export it again from Qualisys Track Manager as TSV with 3D or 6D data"
QUALISYS_HEAD = 20
"""No head of its has more lines."""
QUALISYS_WIDTH = 16
"""Columns a body: X Y Z Roll Pitch Yaw Residual Rot[0] ... Rot[8], its rotation matrix column by column."""


def read_trc(path: str, text: str) -> list[BodyTrack]:
    """Return a track per marker of a TRC (OpenSim, Motion Analysis); an empty cell means not seen.

    Raises InputError where its head lacks the unit or the row of names.
    """
    remedy = "export it again as TRC with Units and with the rows 'Frame#, Time, ...' and 'X1, Y1, Z1, ...'"
    tabs = "tab" if "\t" in text else "whitespace"
    rows = filled_rows(text, tabs)
    head = next((i for i, row in enumerate(rows[:12]) if row.cells[0].lower().startswith("frame")), None)
    keys = next((i for i, row in enumerate(rows[:12]) if "Units" in row.cells), None)
    if head is None or keys is None or keys + 1 >= len(rows):
        raise InputError(path, "no row of names 'Frame#, Time, ...', or no Units", remedy=remedy)
    facts = dict(zip(rows[keys].cells, rows[keys + 1].cells, strict=False))
    unit = length_unit(facts.get("Units", ""))
    names = rows[head].filled[2:]
    data = [row for row in rows[head + 1 :] if number(row.cells[0]) is not None]
    if unit is None or not names or not data:
        problem = f"{len(names)} names, {len(data)} data rows, in the unit '{facts.get('Units', '')}'"
        raise InputError(path, problem, remedy=remedy)
    return _points(path, data, names, (1, "Time"), unit)


def read_vicon(path: str, text: str) -> list[BodyTrack]:
    """Return a track per marker of the trajectories in Vicon Nexus' CSV, by the rate above them.

    Raises InputError for a file without them, as one of devices or models alone is.
    """
    rows = filled_rows(text, "comma")
    begin = next((i for i, row in enumerate(rows) if row.cells[0] == "Trajectories"), None)
    remedy = "export it again from Nexus as CSV with trajectories"
    if begin is None or len(rows) < begin + 6 or not (rate_hz := number(rows[begin + 1].cells[0]) or 0.0) > 0:
        raise InputError(path, "no 'Trajectories' with a rate and data below", remedy=remedy)
    names = [cell.rpartition(":")[2] for cell in rows[begin + 2].filled]
    units = {length_unit(cell) for cell in rows[begin + 4].filled}
    data: list[Row] = []
    for row in rows[begin + 5 :]:
        if not is_value(row.cells[0]):
            break
        data.append(row)
    unit = next(iter(units), None)
    if len(units) != 1 or unit is None or not names or not data:
        raise InputError(path, f"{len(names)} names and {len(data)} data rows in no known unit", remedy=remedy)
    tracks = _points(path, data, names, (0, "Frame"), unit)
    return [BodyTrack(one.name, (one.t_s - one.t_s[0]) / rate_hz, one.position_m, None) for one in tracks]


def _points(path: str, data: list[Row], names: list[str], timed: tuple[int, str], unit: LengthUnit) -> list[BodyTrack]:
    """Return the tracks of the columns from the third on, three a name; ``timed`` is their times' column and name."""
    labels = [timed[1], *(f"{name} {axis}" for name in names for axis in "XYZ")]
    values = numbers(path, data, [timed[0], *range(2, 2 + 3 * len(names))], labels)
    points = METRES[unit] * values[:, 1:].reshape(len(data), len(names), 3)
    return [BodyTrack(name, values[:, 0], np.asarray(points[:, i]), None) for i, name in enumerate(names)]


def read_motive(path: str, text: str) -> list[BodyTrack]:
    """Return a track for every rigid body and marker, Motive's X, Y, Z as they are; empty cells mean not seen.

    Raises InputError for another layout, unit or kind of rotation.
    """
    rows = filled_rows(text, "comma")
    facts = dict(zip(rows[0].cells[::2], rows[0].cells[1::2], strict=False))
    unit = length_unit(facts.get("Length Units", "Meters"))
    head = next((i for i, row in enumerate(rows[:12]) if row.cells[0] == "Frame"), None)
    if unit is None or head is None or head < 3 or len(rows) <= head + 1:
        problem = (
            "no row 'Frame,Time (Seconds),...' with data below, or a unit of length other than meters, centimeters"
        )
        raise InputError(path, f"{problem} or millimeters", remedy=MOTIVE_REMEDY)
    wide = len(rows[head].cells)
    names, kinds = ((*row.cells, *[""] * wide)[:wide] for row in (rows[2], rows[head - 1]))
    axes, data = rows[head].cells, rows[head + 1 :]
    labels = [" ".join(three) for three in zip(names, kinds, axes, strict=True)]
    t_s = numbers(path, data, [1], ["Time (Seconds)"])[:, 0]
    turning, tracks = facts.get("Rotation Type", "Quaternion"), []
    for first in range(2, wide - 2):
        if kinds[first] != "Position" or axes[first : first + 3] != ("X", "Y", "Z"):
            continue
        turned = [i for i in range(2, first) if (names[i], kinds[i]) == (names[first], "Rotation")]
        turns = numbers(path, data, turned, [labels[i] for i in turned])
        three = range(first, first + 3)
        place_m = METRES[unit] * numbers(path, data, three, [labels[i] for i in three])
        rotation = _wxyz(path, turns, "".join(axes[i] for i in turned), turning, facts) if turned else None
        tracks.append(BodyTrack(names[first], t_s, place_m, rotation))
    if not tracks:
        raise InputError(path, "no columns of Position X, Y, Z", where=f"line {rows[head].line}", remedy=MOTIVE_REMEDY)
    return tracks


def _wxyz(path: str, turns: Array, axes: str, turning: str, facts: dict[str, str]) -> Array:
    """Return unit quaternions (n, 4) of Motive's, or of its Euler angles; NaN where they are not seen.

    The angles turn about the body's own axes in the order that the rotation type names (NaturalPoint's help: "Euler
    angle: relative"), whatever the order of the columns; they are degrees unless the head says radians.
    """
    if turning == "Quaternion" and sorted(axes) == sorted("XYZW"):
        return turns[:, [axes.index(axis) for axis in "WXYZ"]]
    if not (MOTIVE_EULER.fullmatch(turning) and sorted(axes) == sorted("XYZ")):
        problem = f"its rotations are of the type '{turning}' in the columns {', '.join(axes)}"
        raise InputError(path, problem, remedy="export them as Quaternion, or as Euler angles such as XYZ")
    angles = turns[:, [axes.index(axis) for axis in turning]]
    seen = np.isfinite(angles).all(axis=1)
    rotation = np.full((len(angles), 4), np.nan)
    radians = facts.get("Rotation Units", "Degrees").lower().startswith("rad")
    if seen.any():
        made = Rotation.from_euler(turning, angles[seen], degrees=not radians)
        rotation[seen] = made.as_quat(scalar_first=True)
    return rotation


def read_qualisys(path: str, text: str) -> list[BodyTrack]:
    """Return a track per body of 6D data, else one per marker, named or not; raises InputError for another head."""
    rows = filled_rows(text, "tab")
    facts = {row.cells[0]: row.cells[1:] for row in rows[:QUALISYS_HEAD]}
    kind = "BODIES" if "NO_OF_BODIES" in facts else "MARKERS"
    try:
        count, rate_hz = int(facts[f"NO_OF_{kind}"][0]), number(facts["FREQUENCY"][0]) or 0.0
    except (KeyError, IndexError, ValueError):
        raise InputError(path, f"no NO_OF_{kind} or FREQUENCY in its header", remedy=QUALISYS_REMEDY) from None
    data = [row for row in rows if number(row.cells[0]) is not None]
    if not data or count < 1 or not rate_hz > 0:
        problem = f"{len(data)} data rows of {count} {kind.lower()} at {rate_hz:g} Hz"
        raise InputError(path, problem, remedy=QUALISYS_REMEDY)
    head = next((row for row in rows[:QUALISYS_HEAD] if "Frame" in row.cells or "Rot[0]" in " ".join(row.cells)), None)
    cells = [] if head is None else list(head.cells)
    before = next((i for i, cell in enumerate(cells) if cell.split()[-1:] == ["X"]), 0)
    timed = "Time" in cells[:before]
    t_s = numbers(path, data, [cells.index("Time")], ["Time"])[:, 0] if timed else np.arange(len(data)) / rate_hz
    width = 3 if kind == "MARKERS" else QUALISYS_WIDTH
    labels = [*facts.get("MARKER_NAMES" if kind == "MARKERS" else "BODY_NAMES", ()), *[""] * count][:count]
    names = [label or f"{'marker' if kind == 'MARKERS' else 'body'} {i + 1}" for i, label in enumerate(labels)]
    columns = [f"{name} column {i + 1}" for name in names for i in range(width)]
    table = numbers(path, data, range(before, before + width * count), columns).reshape(len(data), count, width)
    if kind == "BODIES" and "Rot[0]" not in " ".join(cells):
        raise InputError(path, "no row of columns with Rot[0] to Rot[8]", remedy=QUALISYS_REMEDY)
    tracked = _marker if kind == "MARKERS" else _body
    return [BodyTrack(name, t_s, *tracked(table[:, i])) for i, name in enumerate(names)]


def _marker(table: Array) -> tuple[Array, None]:
    """Return the positions (n, 3); 0.000 on all axes means not seen."""
    return np.where((table == 0).all(axis=1, keepdims=True), np.nan, METRES["mm"] * table), None


def _body(table: Array) -> tuple[Array, Array]:
    """Return the positions (n, 3) and rotations (n, 4); a body not seen has zeros throughout, or no residual."""
    matrix = table[:, 7:].reshape(-1, 3, 3).transpose(0, 2, 1)
    seen = np.isfinite(table).all(axis=1) & (np.abs(np.linalg.det(np.nan_to_num(matrix)) - 1) < 0.05)
    turned = [exponential(log_of(one)) if fine else np.full(4, np.nan) for one, fine in zip(matrix, seen, strict=True)]
    return np.where(seen[:, None], METRES["mm"] * table[:, :3], np.nan), np.array(turned)
