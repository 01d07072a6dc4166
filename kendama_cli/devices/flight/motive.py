"""Tracks of rigid bodies and markers from OptiTrack Motive's CSV export."""

from __future__ import annotations

from kendama_cli.devices.flight.table import numbers, rows_of
from kendama_cli.errors import InputError
from kendama_cli.vision.flight_search import RecordedTrack

METRES = {"meters": 1.0, "centimeters": 1e-2, "millimeters": 1e-3}
REMEDY = "export it again from Motive as CSV with header information and positions"


def read_motive(path: str, text: str) -> list[RecordedTrack]:
    """A track in metres per rigid body or marker that has positions; empty cells mean not seen."""
    rows = rows_of(text, ",")
    facts = dict(zip(rows[0][1][::2], rows[0][1][1::2], strict=False))
    unit = METRES.get(facts.get("Length Units", "Meters").strip().lower())
    head = next((i for i, (_, cells) in enumerate(rows[:12]) if cells[0] == "Frame"), None)
    if unit is None or head is None or head < 3 or len(rows) <= head + 1:
        problem = (
            f"no row 'Frame,Time (Seconds),...' with data below, or a unit of length other than {', '.join(METRES)}"
        )
        raise InputError(path, problem, remedy=REMEDY)
    names, kinds, axes = rows[2][1], rows[head - 1][1], rows[head][1]
    firsts = [
        column
        for column in range(2, len(axes) - 2)
        if list(axes[column : column + 3]) == ["X", "Y", "Z"] and kinds[column] == "Position"
    ]
    if not firsts:
        raise InputError(path, "no columns of Position X, Y, Z", where=f"line {rows[head][0]}", remedy=REMEDY)
    columns = [column + axis for column in firsts for axis in range(3)]
    labels = [f"{names[column]} {axes[column]}" for column in columns]
    values = unit * numbers(path, rows[head + 1 :], columns, labels)
    t_s = numbers(path, rows[head + 1 :], [1], ["Time (Seconds)"])[:, 0]
    return [RecordedTrack(names[column], t_s, values[:, 3 * i : 3 * i + 3]) for i, column in enumerate(firsts)]
