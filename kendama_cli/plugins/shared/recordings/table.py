"""Tracks from tables of text with the columns t_s, x_m, y_m and z_m."""

from __future__ import annotations

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.text_table import filled_rows, numbers
from kendama_cli.errors import InputError

COLUMNS = ("t_s", "x_m", "y_m", "z_m")
ROTATION = ("qw", "qx", "qy", "qz")


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
