"""Reading a recording from text: CSV, TSV or whitespace-separated, with a declared column map."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kendama_cli.devices.hand.recording import Recording, unit_rotations
from kendama_cli.devices.hand.settings import Column, FileCapture
from kendama_cli.devices.hand.stream_server import METRES
from kendama_cli.devices.recording_format import text_of
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import nearest

REMEDY = "give a text file (CSV, TSV or whitespace-separated) or an MCAP file"
DELIMITERS = {"tab": "\t", "semicolon": ";", "comma": ",", "pipe": "|"}
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


@dataclass(frozen=True)
class Row:
    """One line of the file: its number, counted from 1, and its cells."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Rows:
    """A file's rows: those of the header, the last of which holds the names, and the data rows that are read."""

    header: tuple[Row, ...]
    data: tuple[Row, ...]


def read_text(path: str, content: bytes, settings: FileCapture) -> Recording:
    """The recording in the text ``content`` of the file ``path``; raises InputError naming line, column and value."""
    rows = _rows(path, _split(text_of(path, content, remedy=REMEDY), settings), settings)
    scale = METRES[settings.unit]
    axes = []
    for axis, sign in (("x", settings.sign.x), ("y", settings.sign.y), ("z", settings.sign.z)):
        column: Column = getattr(settings.columns, axis)
        values = (
            np.zeros(len(rows.data))
            if column is None
            else _numbers(path, rows, f"capture.columns.{axis}", column, settings)
        )
        axes.append(sign * scale * values)
    if settings.columns.time is None:
        t_s = np.arange(len(rows.data)) / float(settings.rate_hz or np.nan)
    else:
        stamps = _numbers(path, rows, "capture.columns.time", settings.columns.time, settings)
        t_s = (stamps - stamps[0]) * SECONDS[settings.time_unit]
    lines = [row.line for row in rows.data]

    def place(sample: int) -> str:
        return f"line {lines[sample]}"

    return Recording(
        path,
        Path(path).stem,
        t_s,
        np.column_stack(axes),
        place,
        "look at the unit (capture.unit: m, cm or mm) and at capture.columns",
        "look at capture.columns and capture.sign (z points up, x lies in the swing's plane)",
        rotation_wxyz=_rotation(path, rows, settings, place),
    )


def _rotation(path: str, rows: Rows, settings: FileCapture, place: Callable[[int], str]) -> Array | None:
    """The unit quaternions (n, 4) in our axes; None where no columns are named."""
    named = settings.rotation
    parts = []
    for axis, sign in (("w", 1), ("x", settings.sign.x), ("y", settings.sign.y), ("z", settings.sign.z)):
        column: Column = getattr(named, axis)
        if column is None:
            return None
        parts.append(sign * _numbers(path, rows, f"capture.rotation.{axis}", column, settings))
    return unit_rotations(path, np.column_stack(parts), place, from_start=named.upright == "start")


def _split(text: str, settings: FileCapture) -> list[Row]:
    """All rows but comments and leading blank lines."""
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if not (settings.comment and line.lstrip().startswith(settings.comment))
    ]
    lines = list(itertools.dropwhile(lambda numbered: not numbered[1].strip(), lines))
    delimiter = _delimiter(lines, settings.delimiter)
    return [Row(number, tuple(cell.strip().strip('"') for cell in line.split(delimiter))) for number, line in lines]


def _delimiter(lines: Sequence[tuple[int, str]], declared: str) -> str | None:
    """The delimiter, None for whitespace; ``auto`` looks at a line past most headers."""
    if declared != "auto":
        return DELIMITERS.get(declared)
    sample = next((line for _, line in reversed(lines[:50]) if line.strip()), "")
    return next((mark for mark in DELIMITERS.values() if mark in sample), None)


def _rows(path: str, rows: Sequence[Row], settings: FileCapture) -> Rows:
    """Header and data rows; raises InputError where no data row is left.

    Undeclared, the header ends with the last row without any number that comes before the first row of numbers
    alone; so a damaged first data row is not taken for a header.
    """
    header = settings.header_rows
    if header is None:
        first = next((i for i, row in enumerate(rows) if _all_numbers(row)), len(rows))
        header = next((i + 1 for i in range(first - 1, -1, -1) if _no_number(rows[i])), 0)
        if header == len(rows) > 1:
            raise InputError(
                path,
                f"none of its {header} rows holds a number",
                where=f"line {rows[-1].line} has the cells {', '.join(repr(cell) for cell in rows[-1].cells)[:80]}",
                remedy="look at capture.delimiter; decimals are written with a point",
            )
    data = list(rows[header:])
    while data and not any(cell.strip() for cell in data[-1].cells):
        data.pop()
    chosen = data[settings.first_row - 1 : settings.last_row]
    if not chosen:
        raise InputError(
            path,
            f"no data row is left: {len(data)} follow {header} of header, and first_row is {settings.first_row}",
            remedy="give a file that holds a swing, and look at capture.header_rows and capture.first_row",
        )
    return Rows(tuple(rows[:header]), tuple(chosen))


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _all_numbers(row: Row) -> bool:
    filled = [cell for cell in row.cells if cell.strip()]
    return bool(filled) and all(_number(cell) is not None for cell in filled)


def _no_number(row: Row) -> bool:
    filled = [cell for cell in row.cells if cell.strip()]
    return bool(filled) and all(_number(cell) is None for cell in filled)


def _index(path: str, header: Sequence[Row], key: str, column: int | str, base: int) -> int:
    """The position of ``column`` in a row's cells."""
    if isinstance(column, int):
        return column - base
    if not header:
        raise InputError(path, f"no header row, but {key} is the name '{column}'", remedy=f"set {key} to a number")
    names = [cell.strip() for cell in header[-1].cells]
    if names.count(column) != 1:
        found = f"{names.count(column)} columns" if column in names else "no column"
        listed = ", ".join(name for name in names if name)
        raise InputError(
            path,
            f"{found} '{column}' ({key}); its header has {listed[:200] or 'no names'}{nearest(column, names)}",
            where=f"line {header[-1].line}",
            remedy=f"set {key} to one of these names or to a number",
        )
    return names.index(column)


def _numbers(path: str, rows: Rows, key: str, column: int | str, settings: FileCapture) -> Array:
    """The values of one column (n,); raises InputError at the first cell that is missing, empty or not finite."""
    index = _index(path, rows.header, key, column, settings.column_base)
    label = f"column {column}" if isinstance(column, str) else f"column {column} (counted from {settings.column_base})"
    values = np.empty(len(rows.data))
    for i, row in enumerate(rows.data):
        where = f"line {row.line}, {label}"
        if not any(cell.strip() for cell in row.cells):
            raise InputError(
                path, "an empty line amid the data", where=f"line {row.line}", remedy="fill or cut the gap"
            )
        if index >= len(row.cells):
            raise InputError(
                path,
                f"missing: the row has {len(row.cells)} cell{'s' if len(row.cells) != 1 else ''}",
                where=where,
                remedy=f"look at {key} and capture.delimiter",
            )
        cell = row.cells[index].strip()
        value = _number(cell)
        if value is None or not np.isfinite(value):
            shown = "is empty" if not cell else f"'{cell[:40]}' is not a finite number"
            remedy = "fill or cut the gap in the recording, or choose rows without it"
            if cell and value is None:
                remedy = f"look at {key}, capture.delimiter and capture.header_rows"
            raise InputError(path, shown, where=where, remedy=remedy)
        values[i] = value
    return values
