"""Tracks of all markers, named or not, from Qualisys' TSV export."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.flight.table import numbers, rows_of
from kendama_cli.errors import InputError
from kendama_cli.vision.flight_search import RecordedTrack

REMEDY = "export it again from Qualisys Track Manager as TSV with 3D data"
MM_PER_M = 1000.0


def read_qualisys(path: str, text: str) -> list[RecordedTrack]:
    """A track per marker in metres; 0.000 on all axes means not seen."""
    rows = rows_of(text, "\t")
    facts = {cells[0]: list(cells[1:]) for _, cells in rows[:16]}
    try:
        count, rate_hz = int(facts["NO_OF_MARKERS"][0]), float(facts["FREQUENCY"][0])
    except (KeyError, IndexError, ValueError):
        raise InputError(path, "no NO_OF_MARKERS or FREQUENCY in its header", remedy=REMEDY) from None
    data = [(line, cells) for line, cells in rows if _is_number(cells[0])]
    if not data or count < 1 or not rate_hz > 0:
        raise InputError(path, f"{len(data)} data rows of {count} markers at {rate_hz:g} Hz", remedy=REMEDY)
    # with 'Frame' and 'Time' before the markers, or without
    before = 2 if any(cells[0] == "Frame" for _, cells in rows[:16]) else 0
    labels = [label.strip() for label in facts.get("MARKER_NAMES", [])]
    names = [label or f"marker {i + 1}" for i, label in enumerate((labels + [""] * count)[:count])]
    columns = [f"{name} {axis}" for name in names for axis in "XYZ"]
    values = numbers(path, data, range(before, before + 3 * count), columns) / MM_PER_M
    t_s = numbers(path, data, [1], ["Time"])[:, 0] if before else np.arange(len(data)) / rate_hz
    points = values.reshape(len(data), count, 3).transpose(1, 0, 2)
    unseen = (points == 0).all(axis=2, keepdims=True)
    return [
        RecordedTrack(name, t_s, point) for name, point in zip(names, np.where(unseen, np.nan, points), strict=True)
    ]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
