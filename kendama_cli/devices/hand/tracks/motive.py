"""Rigid bodies with quaternions from OptiTrack Motive's CSV export."""

from __future__ import annotations

from kendama_cli.devices.flight.motive import METRES, REMEDY
from kendama_cli.devices.flight.table import numbers, rows_of
from kendama_cli.devices.hand.tracks.body_track import BodyTrack
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array


def read_motive_bodies(path: str, text: str) -> list[BodyTrack]:
    """A track per rigid body or marker, Motive's X, Y, Z as they are; empty cells mean not seen."""
    rows = rows_of(text, ",")
    facts = dict(zip(rows[0][1][::2], rows[0][1][1::2], strict=False))
    unit = METRES.get(facts.get("Length Units", "Meters").strip().lower())
    head = next((i for i, (_, cells) in enumerate(rows[:12]) if cells[0] == "Frame"), None)
    if unit is None or head is None or head < 3 or len(rows) <= head + 1:
        raise InputError(path, "no row 'Frame,Time (Seconds),...' with data below, or no known unit", remedy=REMEDY)
    if (turning := facts.get("Rotation Type", "Quaternion").strip()) != "Quaternion":
        raise InputError(path, f"its rotations are of the type '{turning}'", remedy="export them as Quaternion")
    names, kinds, axes = rows[2][1], rows[head - 1][1], rows[head][1]
    data = rows[head + 1 :]
    t_s = numbers(path, data, [1], ["Time (Seconds)"])[:, 0]

    def columns(first: int, count: int) -> Array:
        wanted = range(first, first + count)
        return numbers(path, data, wanted, [f"{names[i]} {kinds[i]} {axes[i]}" for i in wanted])

    tracks = []
    for first in range(2, len(axes) - 2):
        if kinds[first] != "Position" or list(axes[first : first + 3]) != ["X", "Y", "Z"]:
            continue
        turned = None
        before = first - 4
        if before >= 2 and kinds[before] == "Rotation" and list(axes[before:first]) == ["X", "Y", "Z", "W"]:
            turned = columns(before, 4)[:, [3, 0, 1, 2]] if names[before] == names[first] else None
        tracks.append(BodyTrack(names[first], t_s, unit * columns(first, 3), turned))
    if not tracks:
        raise InputError(path, "no columns of Position X, Y, Z", where=f"line {rows[head][0]}", remedy=REMEDY)
    return tracks
