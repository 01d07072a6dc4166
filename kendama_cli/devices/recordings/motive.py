"""Rigid bodies and markers from OptiTrack Motive's CSV export."""

from __future__ import annotations

import re

import numpy as np
from scipy.spatial.transform import Rotation

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.text_table import filled_rows, numbers
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import METRES, length_unit

REMEDY = "export it again from Motive as CSV with header information and positions"
EULER = re.compile(r"[XYZ]{3}")


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
        raise InputError(path, f"{problem} or millimeters", remedy=REMEDY)
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
        raise InputError(path, "no columns of Position X, Y, Z", where=f"line {rows[head].line}", remedy=REMEDY)
    return tracks


def _wxyz(path: str, turns: Array, axes: str, turning: str, facts: dict[str, str]) -> Array:
    """Return unit quaternions (n, 4) of Motive's, or of its Euler angles; NaN where they are not seen.

    The angles turn about the body's own axes in the order that the rotation type names (NaturalPoint's help: "Euler
    angle: relative"), whatever the order of the columns; they are degrees unless the head says radians.
    """
    if turning == "Quaternion" and sorted(axes) == sorted("XYZW"):
        return turns[:, [axes.index(axis) for axis in "WXYZ"]]
    if not (EULER.fullmatch(turning) and sorted(axes) == sorted("XYZ")):
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
