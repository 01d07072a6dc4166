"""Reading a recording from text: CSV, TSV or whitespace-separated, with a declared column map."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.devices.demonstrator.recording import Recording, unit_rotations
from kendama_cli.devices.demonstrator.settings import Column, FileCapture
from kendama_cli.devices.recordings.recording_format import layout_command, name_of, text_of
from kendama_cli.devices.recordings.text_table import JUDGED, Row, exact_seconds, head_length, number, rows_of, times
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.hints import nearest
from kendama_cli.schema.units import METRES, SECONDS, count_of, length_unit, time_unit

ORIGIN = re.compile(r"^#\s*(?:origin\s*[:=]\s*([a-z]{1,20})|(synthetic))\b", re.IGNORECASE | re.MULTILINE)
"""The line of a head that says who or what made the swing."""
MAX_HEAD_CHARACTERS = 2000
REMEDY = "give a text file (CSV, TSV or whitespace-separated) or an MCAP file"


@dataclass(frozen=True)
class Rows:
    """A file's rows: those of the header, one of which holds the names, and the data rows that are read."""

    header: tuple[Row, ...]
    data: tuple[Row, ...]


def read_text(path: str, content: bytes, settings: FileCapture) -> Recording:
    """Read the recording in the text ``content`` of file ``path``; raises InputError naming line, column and value."""
    text = text_of(path, content, remedy=REMEDY)
    rows = split_rows(path, text, settings)
    _check_units(path, rows, settings)
    columns = (settings.columns.x, settings.columns.y, settings.columns.z)
    axes = [
        np.zeros(len(rows.data))
        if column is None
        else _numbers(path, rows, f"capture.columns.{axis}", column, settings)
        for axis, column in zip("xyz", columns, strict=True)
    ]
    lines = [row.line for row in rows.data]

    def where(sample: int) -> str:
        return f"line {lines[sample]}"

    return Recording(
        path,
        name_of(path),
        _seconds(path, rows, settings),
        METRES[settings.unit] * np.column_stack(axes),
        where,
        f"look at the unit (capture.unit) and at capture.columns, or type: {layout_command(path)}",
        "look at capture.columns and capture.sign (z points up, x lies in the swing's plane), or type: "
        + layout_command(path),
        rotation_wxyz=_rotation(path, rows, settings, where),
        origin=(found[1] or found[2]).lower() if (found := ORIGIN.search(text[:MAX_HEAD_CHARACTERS])) else "",
    )


def _seconds(path: str, rows: Rows, settings: FileCapture) -> Array:
    """Return the samples' times from the first on (n,): of numbers in the declared unit, of dates or of clocks."""
    column = settings.columns.time
    if column is None:
        return np.arange(len(rows.data)) / float(settings.rate_hz or np.nan)
    index = _index(path, rows.header, "capture.columns.time", column, settings.column_base)
    cells = [row.cells[index] if index < len(row.cells) else "" for row in rows.data]
    written = None if number(cells[0]) is not None else times(cells)
    if written is not None:
        return written
    stamps = _numbers(path, rows, "capture.columns.time", column, settings)
    return exact_seconds(cells, stamps, SECONDS[settings.time_unit])


def _rotation(path: str, rows: Rows, settings: FileCapture, where: Callable[[int], str]) -> Array | None:
    """Return the unit quaternions (n, 4) of the named columns; None if none are named."""
    named = settings.rotation
    if named.w is None:
        return None
    columns: list[Column] = [named.w, named.x, named.y, named.z]
    parts = [
        _numbers(path, rows, f"capture.rotation.{axis}", column, settings)
        for axis, column in zip("wxyz", columns, strict=True)
        if column is not None
    ]
    return unit_rotations(path, np.column_stack(parts), where, from_start=named.upright == "start")


def split_rows(path: str, text: str, settings: FileCapture) -> Rows:
    """Split into header and data rows, without leading comments and blank lines; raises InputError without data.

    A comment before the data may hold the names, as numpy writes them, where no row of the header does.
    """
    lines = text.splitlines()
    mark = settings.comment
    remarks = [i for i, line in enumerate(lines) if mark and line.lstrip().startswith(mark)]
    bare = "\n".join("" if i in set(remarks) else line for i, line in enumerate(lines)) if remarks else text
    rows = [row for row in rows_of(bare, settings.delimiter) if row.line - 1 not in set(remarks)]
    rows = list(itertools.dropwhile(lambda row: not row.filled, rows))
    header = settings.header_rows
    if header is None:
        header = head_length(rows)
        if not any(number(cell) is not None for row in rows[header - 1 :] for cell in row.filled) and len(rows) > 1:
            raise InputError(
                path,
                f"none of its {len(rows)} rows holds a number",
                where=f"line {rows[-1].line} has the cells {', '.join(repr(cell) for cell in rows[-1].cells)[:80]}",
                remedy="look at capture.delimiter",
            )
    data = list(itertools.dropwhile(lambda row: not row.filled, rows[header:]))
    while data and not data[-1].filled:
        data.pop()
    if 2 * sum(not row.filled for row in data) >= len(data) - 1 > 1:  # each line ended twice, as \r\r\n does
        data = [row for row in data if row.filled]
    chosen = data[settings.first_row - 1 : settings.last_row]
    if not chosen:
        raise InputError(
            path,
            f"no data row is left: {len(data)} follow {header} of header, and first_row is {settings.first_row}",
            remedy="give a file that holds a swing, and look at capture.header_rows and capture.first_row",
        )
    named, given = len(rows[header - 1].filled) if header else 0, len(chosen[0].cells)
    if named and given == 2 * named and all(cell.lstrip("-").isdecimal() for cell in chosen[0].cells):
        raise InputError(
            path,
            f"its rows have {given} cells under {named} names: commas stand between columns and before decimals",
            where=f"line {chosen[0].line}",
            remedy="export it with semicolons or tabs between the columns",
        )
    before = chosen[0].line
    numbered = "\n".join(lines[before - 1 : before - 1 + JUDGED])  # what separates cells is judged by the data
    remarked = {i + 1: "\n" * i + f"{lines[i].lstrip()[len(mark) :]}\n{numbered}" for i in remarks if i < before}
    commented = [rows_of(one, settings.delimiter, line)[0] for line, one in remarked.items()]
    return Rows((*(row for row in commented if row.filled), *rows[:header]), tuple(chosen))


def _check_units(path: str, rows: Rows, settings: FileCapture) -> None:
    """Raise InputError where a row of units stands in the header and says another unit than the settings."""
    columns = settings.columns
    for axis, column in (("time", columns.time), ("x", columns.x), ("y", columns.y), ("z", columns.z)):
        if column is None or not rows.header:
            continue
        key, declared = ("time_unit", settings.time_unit) if axis == "time" else ("unit", settings.unit)
        row = rows.header[-1]
        index = _index(path, rows.header, f"capture.columns.{axis}", column, settings.column_base)
        cell = row.cells[index] if index < len(row.cells) else ""
        text = (time_unit if axis == "time" else length_unit)(cell)
        if text not in (None, declared):
            problem = f"the row of units says '{cell}' for column {column}, and capture.{key} is {declared}"
            remedy = f"set capture.{key}={text}, or type: {layout_command(path)}"
            raise InputError(path, problem, where=f"line {row.line}", remedy=remedy)


def _index(path: str, header: Sequence[Row], key: str, column: int | str, base: int) -> int:
    """Return the index of ``column`` in a row's cells: a name's in the last row of the header that has it."""
    if isinstance(column, int):
        return column - base
    if not header:
        raise InputError(
            path, f"no header row, but {key} is the name '{column}'", remedy=f"type: {layout_command(path)}"
        )
    row = next((row for row in reversed(header) if column in row.cells), None)
    if row is None:  # the last row may hold units
        row = max(
            reversed(header[-2:]), key=lambda row: len({cell for cell in row.filled if length_unit(cell) is None})
        )
    if row.cells.count(column) != 1:
        found = f"{row.cells.count(column)} columns" if column in row.cells else "no column"
        raise InputError(
            path,
            f"{found} '{column}' ({key}); its header has {', '.join(row.filled)[:200] or 'no names'}"
            f"{nearest(column, row.cells)}",
            where=f"line {row.line}",
            remedy=f"set {key} to one of these names or to a number, or type: {layout_command(path)}",
        )
    return row.cells.index(column)


def _without(rows: Sequence[Row], first: int, index: int, settings: FileCapture) -> str:
    """Return the remedy for cells of column ``index`` that hold no number from row ``first`` on."""
    last = first
    while last + 1 < len(rows) and not _has_number(rows[last + 1].cells, index):
        last += 1
    missing = last - first + 1
    lines = f"line {rows[first].line}" if missing == 1 else f"lines {rows[first].line} to {rows[last].line}"
    if last + 1 == len(rows):
        end = f"type capture.last_row={settings.first_row - 1 + first}, or " if first else ""
        return f"{end}look at capture.columns: no number follows"
    bridge = f" and type capture.gap_factor={missing + 1.5:g}" if missing + 1 > settings.gap_factor else ""
    return f"delete {lines}{bridge}: the samples around are then joined; or fill the gap"


def _has_number(cells: Sequence[str], index: int) -> bool:
    value = number(cells[index]) if index < len(cells) else None
    return value is not None and math.isfinite(value)


def _numbers(path: str, rows: Rows, key: str, column: int | str, settings: FileCapture) -> Array:
    """Return the values of one column (n,); raises InputError at the first missing, empty or not finite cell."""
    index = _index(path, rows.header, key, column, settings.column_base)
    label = f"column {column}" if isinstance(column, str) else f"column {column} (counted from {settings.column_base})"
    values = np.empty(len(rows.data))
    for i, row in enumerate(rows.data):
        where = f"line {row.line}, {label}"
        if not row.filled:
            raise InputError(
                path,
                "an empty line amid the data",
                where=f"line {row.line}",
                remedy=_without(rows.data, i, index, settings),
            )
        if index >= len(row.cells):
            raise InputError(
                path,
                f"missing: the row has {count_of(len(row.cells), 'cell')}",
                where=where,
                remedy=f"look at {key} and capture.delimiter",
            )
        cell = row.cells[index]
        value = number(cell)
        if value is None or not math.isfinite(value):
            shown = "is empty" if not cell else f"'{cell[:40]}' is not a finite number"
            remedy = _without(rows.data, i, index, settings)
            if cell and value is None:
                remedy = f"look at {key}, capture.delimiter and capture.header_rows"
            raise InputError(path, shown, where=where, remedy=remedy)
        values[i] = value
    return values
