"""A track from a plain CSV, and what all text formats share: numbers by line and cell, and the check of time."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.flight_search import RecordedTrack

Row = tuple[int, Sequence[str]]
"""A line's number, counted from 1, and its cells."""
COLUMNS = ("t_s", "x_m", "y_m", "z_m")


def rows_of(text: str, delimiter: str, begin_line: int = 1) -> list[Row]:
    """The rows that hold anything, from ``begin_line`` on."""
    lines = enumerate(csv.reader(text.splitlines(), delimiter=delimiter), start=1)
    return [(number, cells) for number, cells in lines if number >= begin_line and any(cell.strip() for cell in cells)]


def numbers(path: str, rows: Sequence[Row], columns: Sequence[int], names: Sequence[str]) -> Array:
    """The cells of ``columns`` (n, k); nan where a cell is empty. Raises InputError at what is no number."""
    values = np.full((len(rows), len(columns)), np.nan)
    for i, (line, cells) in enumerate(rows):
        for j, column in enumerate(columns):
            cell = cells[column].strip() if column < len(cells) else ""
            try:
                values[i, j] = float(cell) if cell else math.nan
            except ValueError:
                where = f"line {line}, column {names[j]}"
                remedy = "write decimals with a point, and leave a cell empty where the point was not seen"
                raise InputError(path, f"'{cell[:40]}' is not a number", where=where, remedy=remedy) from None
    return values


def read_table(path: str, text: str) -> list[RecordedTrack]:
    """The one track of a CSV whose header names the columns t_s, x_m, y_m and z_m, in any order among others."""
    rows = rows_of(text, "\t" if "\t" in text.split("\n", 1)[0] else ",")
    header = [cell.strip().lower() for cell in rows[0][1]] if rows else []
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        listed = ", ".join(name for name in header if name)[:120] or "nothing"
        remedy = "name the columns t_s,x_m,y_m,z_m in the first line (seconds and metres)"
        if len(missing) == len(COLUMNS) and len(rows[0][1] if rows else []) == 1 and ";" in header[0]:
            problem = "its columns are separated by ';', as a spreadsheet of another language writes them"
            remedy = "separate columns by commas and write decimals with a point: t_s,x_m,y_m,z_m"
            raise InputError(path, problem, where=f"line {rows[0][0]}", remedy=remedy)
        problem = f"its header lacks {', '.join(missing)}; it has {listed}"
        raise InputError(path, problem, where=f"line {rows[0][0] if rows else 1}", remedy=remedy)
    values = numbers(path, rows[1:], [header.index(name) for name in COLUMNS], COLUMNS)
    return [RecordedTrack("ball", values[:, 0], values[:, 1:])]


def checked(path: str, track: RecordedTrack) -> RecordedTrack:
    """The track itself; raises InputError where its time does not rise."""
    wrong = np.flatnonzero(~(np.diff(track.t_s) > 0))
    if len(wrong):
        i = int(wrong[0])
        problem = f"time does not rise: {track.t_s[i + 1]:.6g} s after {track.t_s[i]:.6g} s"
        remedy = "sort the samples, drop repeated ones, and give every one a time"
        raise InputError(path, problem, where=f"sample {i + 2} of '{track.name}'", remedy=remedy)
    return track
