"""Tables of numbers as programs and spreadsheets write them: what separates cells, decimals, heads, units and times."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array

DELIMITERS = {"tab": "\t", "semicolon": ";", "comma": ",", "pipe": "|", "whitespace": None}
LOOKED_AT = 200
"""So many lines are read to find the delimiter: more than any head has."""
JUDGED = 8
"""By so many of the last of them it is judged."""

_DECIMAL_COMMA = re.compile(r"[-+]?(\d+,\d*|,\d+)([eE][-+]?\d+)?")
_CLOCK = re.compile(r"(\d+:)?\d{1,2}:\d{2}([.,]\d*)?")
_DATE = re.compile(r"(\d{4}-\d{2}-\d{2}|\d{1,2}[./]\d{1,2}[./]\d{4}|\d{8}T)[T ,]*(\d.*)?")
DAY_S = 86_400.0


@dataclass(frozen=True)
class Row:
    """One line of a file: its number, counted from 1, and its cells without blanks and quotes around them."""

    line: int
    cells: tuple[str, ...]

    @property
    def filled(self) -> list[str]:
        """The cells that hold anything."""
        return [cell for cell in self.cells if cell]


def rows_of(text: str, delimiter: str = "auto", begin_line: int = 1) -> list[Row]:
    """Return all lines from ``begin_line`` on as rows, empty ones too; ``delimiter`` is a key of DELIMITERS or auto."""
    lines = [one for one in enumerate(text.splitlines(), start=1) if one[0] >= begin_line]
    mark = _delimiter([line for _, line in lines[:LOOKED_AT]]) if delimiter == "auto" else DELIMITERS[delimiter]
    return [Row(number, _cells(line, mark)) for number, line in lines]


def filled_rows(text: str, delimiter: str = "auto", begin_line: int = 1) -> list[Row]:
    """Return the rows that hold anything."""
    return [row for row in rows_of(text, delimiter, begin_line) if row.filled]


def _cells(line: str, mark: str | None) -> tuple[str, ...]:
    if mark is None or '"' not in line:
        return tuple(cell.strip().strip('"') for cell in line.split(mark))
    try:
        (cells,) = csv.reader([line], delimiter=mark, skipinitialspace=True)
    except (csv.Error, ValueError):
        cells = line.split(mark)
    return tuple(cell.strip().strip('"') for cell in cells)


def _delimiter(lines: Sequence[str]) -> str | None:
    """Return the delimiter that makes the most cells numbers, and of equal ones the most cells."""
    judged = [line for line in lines if line.strip()][-JUDGED:]

    def worth(mark: str | None) -> tuple[float, int]:
        cells = [cell for line in judged for cell in _cells(line, mark) if cell]
        return sum(map(is_value, cells)) / max(len(cells), 1), len(cells)

    return max(DELIMITERS.values(), key=worth)


def number(cell: str) -> float | None:
    """Return the number in a cell, with a point or a comma before its decimals; None where there is none."""
    plain = cell.replace("\N{MINUS SIGN}", "-")
    try:
        return None if "_" in plain else float(plain)
    except ValueError:
        return float(plain.replace(",", ".")) if _DECIMAL_COMMA.fullmatch(plain) else None


def is_value(cell: str) -> bool:
    """Return True for a cell that holds a number or a time."""
    return number(cell) is not None or _CLOCK.fullmatch(cell) is not None or _DATE.fullmatch(cell) is not None


def head_length(rows: Sequence[Row]) -> int:
    """Return how many rows stand before the data.

    They end with the last row without any value before the first row of values alone, so that a damaged first data
    row is not taken for a head. Fewer cells than half of what most rows have are no data: a rate in the head, say.
    """
    wide = 0.5 * float(np.median([len(row.filled) for row in rows])) if rows else 0.0
    first = next(
        (i for i, row in enumerate(rows) if len(row.filled) > wide and all(map(is_value, row.filled))), len(rows)
    )
    return next(
        (i + 1 for i in range(first - 1, -1, -1) if rows[i].filled and not any(map(is_value, rows[i].filled))), 0
    )


def numbers(path: str, rows: Sequence[Row], columns: Sequence[int], names: Sequence[str]) -> Array:
    """Return the cells of ``columns`` (n, k); nan where a cell is empty. Raises InputError at what is no number."""
    values = np.full((len(rows), len(columns)), math.nan)
    for i, row in enumerate(rows):
        for j, column in enumerate(columns):
            cell = row.cells[column] if column < len(row.cells) else ""
            value = number(cell) if cell else math.nan
            if value is None:
                where = f"line {row.line}, column {names[j]}"
                remedy = "leave a cell empty where the point was not seen"
                raise InputError(path, f"'{cell[:40]}' is not a number", where=where, remedy=remedy)
            values[i, j] = value
    return values


def times(cells: Sequence[str]) -> Array | None:
    """Return the seconds (n,) since the first of several times; None where they are none.

    Dates and times by ISO 8601, with zones or without, those of a spreadsheet (day first where points stand between),
    and clocks (hours, minutes and seconds), also past midnight.
    """
    if all(_CLOCK.fullmatch(cell) for cell in cells):
        parts = [[float(part.replace(",", ".")) for part in reversed(cell.split(":"))] for cell in cells]
        seconds = np.array([sum(part * 60.0**power for power, part in enumerate(one)) for one in parts])
        return np.asarray(np.unwrap(seconds, period=DAY_S) - seconds[0])
    if not all(_DATE.fullmatch(cell) for cell in cells):
        return None
    import pandas as pd  # noqa: PLC0415 - a second to import, and few files have dates

    plain = [re.sub(r"(:\d+),(\d+)", r"\1.\2", cell) for cell in cells]
    try:
        stamps = pd.to_datetime(plain, utc=True, format="mixed" if "/" in plain[0] or plain[0][2] == "." else "ISO8601",
                                dayfirst="." in plain[0][:3])  # fmt: skip
    except (ValueError, OverflowError):
        return None
    stamps_ns = stamps.as_unit("ns").asi8
    return np.asarray((stamps_ns - stamps_ns[0]) * 1e-9)


def exact_seconds(cells: Iterable[str], values: Array, unit_s: float) -> Array:
    """Return the seconds (n,) since the first of stamps in a unit: whole numbers exactly, beyond what a float holds."""
    given = list(cells)
    if all(cell.isdecimal() for cell in given):
        values = np.array([int(cell) - int(given[0]) for cell in given], dtype=np.float64)
    return np.asarray((values - values[0]) * unit_s)
