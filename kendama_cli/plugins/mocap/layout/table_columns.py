"""A table's columns by what they hold: times, counters, triples of places, quaternions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.devices.demonstrator.text import Rows
from kendama_cli.devices.recordings.text_table import Row, number, times
from kendama_cli.plugins.mocap.layout.column_names import COUNTERS, named
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import LengthUnit, length_unit, time_unit

UNIT_NORM = 0.02
"""A quaternion's length may differ from 1 by so much: exports round."""
_RATE = re.compile(
    r"(?:rate|freq\w*|fps|\bhz)\D{0,24}?(\d+(?:[.,]\d+)?)|(\d+(?:[.,]\d+)?)\s*(?:hz|fps)\b", re.IGNORECASE
)
_UNIT = re.compile(r"\b(?:units?|einheit\w*)\W+(\w+)", re.IGNORECASE)


@dataclass(frozen=True)
class Places:
    """Three columns, by index, that may be a place along x, y and z (None: not recorded), with what names them."""

    body: str
    columns: tuple[int | None, int | None, int | None]
    unit: LengthUnit | None = None
    turn: tuple[int, int, int, int] | None = None
    """the columns of the quaternion beside it, w first"""


class Table:
    """Numbers ``values`` (n, k) of the data rows, NaN where a cell holds none, and the names above them."""

    def __init__(self, rows: Rows) -> None:
        self.header, self.data = rows.header, rows.data
        self.width = int(np.median([len(row.cells) for row in rows.data]))
        self.labels, self.units = _labels(rows.header, self.width)
        cells = [[row.cells[k] if k < len(row.cells) else "" for row in rows.data] for k in range(self.width)]
        self.values = np.array([[_float(cell) for cell in column] for column in cells], dtype=np.float64).T
        self._cells = cells
        self.meaning = [named(label, unit) for label, unit in zip(self.labels, self.units, strict=True)]

    def cells(self, column: int) -> list[str]:
        """Return the cells of a column as they are written."""
        return self._cells[column]

    def reference(self, column: int) -> int | str:
        """Return what ``capture.columns`` calls a column: its name where that is unique, else its number from 1."""
        name = self.labels_alone[column] if self.labels_alone else ""
        row = next((row for row in reversed(self.header) if name and name in row.cells), None)
        plain = row is not None and row.cells.count(name) == 1 and row.cells.index(name) == column
        return name if plain and number(name) is None else column + 1

    @property
    def labels_alone(self) -> tuple[str, ...]:
        """The cells of the row of names."""
        row = _names_row(self.header)
        return () if row is None else (*row.cells, *[""] * self.width)[: self.width]

    def shown(self, column: int | None) -> str:
        """Return a column as a reader finds it in the file."""
        if column is None:
            return "-"
        return self.labels_alone[column] if self.labels_alone and self.labels_alone[column] else f"column {column + 1}"

    def rate_hz(self) -> float | None:
        """Return the rate that the lines above the data tell."""
        found = _RATE.search(_text(self.header))
        value = None if found is None else number(found[1] or found[2])
        return value if value and value > 1 else None

    def unit(self) -> LengthUnit | None:
        """Return the unit of length that the lines above the data tell for all of them."""
        found = _UNIT.search(_text(self.header))
        return None if found is None else length_unit(found[1])

    def time_columns(self) -> list[int]:
        """Return the columns that may be times: those whose names say so, else the first that rises steadily."""
        told = [k for k, one in enumerate(self.meaning) if one.kind == "time" and self._rises(k)]
        dated = [
            k for k in range(self.width) if np.isnan(self.values[:2, k]).all() and times(self.cells(k)) is not None
        ]
        rising = [k for k in range(self.width) if not self.labels[k] and self._rises(k) and not self._counts(k)]
        return told or dated or rising[:1]

    def counters(self) -> list[int]:
        """Return the columns that count the rows, or are called so."""
        return [
            k
            for k in range(self.width)
            if self._counts(k) or set(re.findall(r"[a-z]+|#", self.labels[k].lower())) & COUNTERS
        ]

    def places(self) -> list[Places]:
        """Return the triples of columns that may be places: by their names, or side by side where none are named."""
        found = self._named_places() if any(self.labels) else []
        return [one for one in found or self._unnamed_places() if self._is_seen(one)]

    def _is_seen(self, place: Places) -> bool:
        """Return True if two rows or more have all numbers of ``place``."""
        columns = [k for k in place.columns if k is not None]
        return int(np.isfinite(self.values[:, columns]).all(axis=1).sum()) > 1

    def _rises(self, column: int) -> bool:
        values = self.values[:, column]
        if not np.isfinite(values).all():
            return times(self.cells(column)) is not None
        if not (steps := np.diff(values)).size:
            return False
        usual = float(np.median(steps))
        return bool((steps >= 0).all()) and values[-1] > values[0] and bool((steps <= 20 * usual).mean() > 0.9)

    def _counts(self, column: int) -> bool:
        steps = np.diff(self.values[:, column])
        return (
            len(steps) > 0
            and bool((steps == steps[0]).all())
            and steps[0] in (1.0, 2.0, 5.0, 10.0)
            and (self.meaning[column].kind != "time")
        )

    def _named_places(self) -> list[Places]:
        bodies: dict[tuple[str, str], dict[str, int]] = {}
        for k, one in enumerate(self.meaning):
            if one.kind in ("place", "turn") and np.isfinite(self.values[:, k]).any():
                bodies.setdefault((one.kind, one.body), {}).setdefault(one.axis, k)
        turns = {body: self._turn(axes) for (kind, body), axes in bodies.items() if kind == "turn"}
        only = next(iter(turns.values())) if len(turns) == 1 else None
        placed = {
            body: axes
            for (kind, body), axes in bodies.items()
            if kind == "place" and len(axes) > 1 and not self._turn(bodies.get(("turn", body), {}) | axes)
        }
        return [
            Places(
                body,
                (axes.get("x"), axes.get("y"), axes.get("z")),
                self.meaning[next(iter(axes.values()))].length,
                turns.get(body, only if len(placed) == 1 else None),
            )
            for body, axes in placed.items()
        ]

    def _turn(self, axes: dict[str, int]) -> tuple[int, int, int, int] | None:
        if set(axes) != set("wxyz"):
            return None
        columns = (axes["w"], axes["x"], axes["y"], axes["z"])
        return columns if self._unit_norm(columns) else None

    def _unit_norm(self, columns: Sequence[int]) -> bool:
        norms = np.linalg.norm(self.values[:, list(columns)], axis=1)
        return bool((np.abs(norms - 1) < UNIT_NORM).all())

    def _unnamed_places(self) -> list[Places]:
        taken = {*self.time_columns(), *self.counters()}
        turns = [
            four
            for k in range(self.width - 3)
            if not taken & set(four := tuple(range(k, k + 4))) and self._unit_norm(four)
        ]
        taken |= {k for four in turns for k in four} | {k for k, one in enumerate(self.meaning) if one.excluded}
        for k in range(self.width - 2):  # a direction, or a row of a rotation matrix
            if not taken & set(three := (k, k + 1, k + 2)) and self._unit_norm(three):
                taken |= set(three)
        found = []
        for k in range(self.width - 2):
            three = (k, k + 1, k + 2)
            varied = [np.isfinite(self.values[:, i]).any() and np.nanstd(self.values[:, i]) > 0 for i in three]
            if not taken & set(three) and sum(varied) > 1:
                found.append(Places("", three))
        if len(found) == 1 and len(turns) == 1 and self.width == 8 and turns[0] == (4, 5, 6, 7):  # TUM: qx qy qz qw
            return [Places("", found[0].columns, turn=(7, 4, 5, 6))]
        return found


def is_gravity(place: Array) -> bool:
    """Return True if ``place`` (n, 3) begins with lengths of 9.8: an accelerometer at rest, not a place."""
    norms = np.linalg.norm(place[: max(5, len(place) // 10)], axis=1)
    return bool(np.median(np.abs(norms - 9.81)) < 0.25)


def _float(cell: str) -> float:
    value = number(cell) if cell else None
    return float("nan") if value is None else value


def _text(header: Sequence[Row]) -> str:
    return "\n".join(" ".join(row.filled) for row in header)


def _is_units(row: Row) -> bool:
    cells = row.filled
    told = [length_unit(cell) or time_unit(cell) for cell in cells]
    return sum(one is not None for one in told) * 2 >= max(len(cells), 1)


def _names_row(header: Sequence[Row]) -> Row | None:
    """Return the last row of the head that is no row of units and has as many cells as any after it."""
    rows = [row for row in header[-3:] if not _is_units(row)]
    return max(reversed(rows), key=lambda row: len(row.filled), default=None)


def _labels(header: Sequence[Row], width: int) -> tuple[list[str], list[str]]:
    """Return a label and a unit for each column: the row of names, behind the row above it where names repeat."""
    row = _names_row(header)
    if row is None or len(row.filled) < 2:
        return [""] * width, [""] * width
    at = list(header).index(row)
    cells = (*row.cells, *[""] * width)[:width]
    below = next((one for one in header[at + 1 :] if _is_units(one)), None)
    units = ("",) * width if below is None else (*below.cells, *[""] * width)[:width]
    if at and len(set(row.filled)) < len(row.filled):
        above, last = [], ""
        for cell in (*header[at - 1].cells, *[""] * width)[:width]:
            last = cell or last
            above.append(last)
        return [f"{one} {cell}".strip() for one, cell in zip(above, cells, strict=True)], list(units)
    return list(cells), list(units)
