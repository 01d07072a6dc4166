"""Tracks of markers from tables of text: TRC, Vicon's CSV, and plain ones with the columns t_s, x_m, y_m and z_m."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.text_table import Row, filled_rows, is_value, number, numbers
from kendama_cli.errors import InputError
from kendama_cli.schema.units import METRES, LengthUnit, length_unit

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
    """Tracks of the columns from the third on, three a name; ``timed`` is the column of their times, and its name."""
    labels = [timed[1], *(f"{name} {axis}" for name in names for axis in "XYZ")]
    values = numbers(path, data, [timed[0], *range(2, 2 + 3 * len(names))], labels)
    points = METRES[unit] * values[:, 1:].reshape(len(data), len(names), 3)
    return [BodyTrack(name, values[:, 0], np.asarray(points[:, i]), None) for i, name in enumerate(names)]
