"""Files of the apps that record a phone's sensors: zip archives, tables of one folder, and single tables."""

from __future__ import annotations

import csv
import zipfile
import zlib
from dataclasses import dataclass
from io import StringIO
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from kendama_cli.devices.recordings.recording_format import text_of
from kendama_cli.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

MAX_BYTES = 64 << 20
"""An hour at 500 Hz; a swing takes some hundred kilobytes."""
MAX_FILES = 500
TABLES = (".csv", ".tsv", ".txt")
EXCEL = (".xls", ".xlsx")
EXPORT = "export it as CSV (phyphox: Export Data, 'CSV (Comma, decimal point)')"


@dataclass(frozen=True)
class Table:
    """One table of an app: the file's name without its ending, and its columns as text or numbers.

    A ``problem`` with its rows, which ``frame`` lacks then, matters only where the table is used.
    """

    path: str
    stem: str
    frame: pd.DataFrame
    problem: str | None = None


@dataclass(frozen=True)
class Export:
    """Tables that belong together: of a zip, of a folder in it, of a folder, or a single one."""

    path: str
    name: str
    tables: tuple[Table, ...]


def read_exports(paths: tuple[str, ...]) -> list[Export]:
    """Return the tables of all files, those of one folder together, in the order of the files.

    Raises InputError for an Excel file, an archive that is damaged or too large, and one without tables.
    """
    groups: dict[tuple[str, str], list[Table]] = {}
    for path in paths:
        file = Path(path)
        if file.suffix.lower() in EXCEL:
            raise InputError(path, "is an Excel file", remedy=EXPORT)
        if zipfile.is_zipfile(file):
            for member, content in _members(path):
                place = PurePosixPath(member)
                folder = str(place.parent)
                if content.strip():  # of a sensor that the phone lacks
                    groups.setdefault((path, folder), []).append(_table(f"{path}/{member}", place.stem, content))
        else:
            if file.stat().st_size > MAX_BYTES:
                raise InputError(path, f"{file.stat().st_size >> 20} MB; allowed: {MAX_BYTES >> 20}", remedy=EXPORT)
            groups.setdefault((str(file.parent), ""), []).append(_table(path, file.stem, file.read_bytes()))
    exports = []
    for (path, folder), tables in groups.items():
        alone = tables[0].path if not folder and len(tables) == 1 else path
        exports.append(Export(alone, PurePosixPath(folder).name or Path(alone).stem, tuple(tables)))
    return exports


def _members(path: str) -> list[tuple[str, bytes]]:
    """Return names and contents of the tables in an archive, never more bytes than are allowed."""
    try:
        with zipfile.ZipFile(path) as archive:
            entries = [one for one in archive.infolist() if not one.is_dir()]
            if len(entries) > MAX_FILES:
                raise InputError(path, f"{len(entries)} files in the zip; allowed: {MAX_FILES}", remedy=EXPORT)
            names = [one.filename for one in entries]
            if any(name.lower().endswith(EXCEL) for name in names) or "[Content_Types].xml" in names:
                raise InputError(path, "holds an Excel file", remedy=EXPORT)
            left, found = MAX_BYTES, []
            for entry in entries:
                place = PurePosixPath(entry.filename)
                if place.suffix.lower() not in TABLES or "__MACOSX" in place.parts or "meta" in place.parts:
                    continue
                with archive.open(entry) as stream:  # the size in the head may lie: what is read is bounded
                    content = stream.read(left + 1)
                if (left := left - len(content)) < 0:
                    raise InputError(path, f"more than {MAX_BYTES >> 20} MB unpacked", remedy=EXPORT)
                found.append((entry.filename, content))
    except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError, EOFError, zlib.error) as wrong:
        raise InputError(path, f"cannot be unpacked ({wrong})", remedy=EXPORT) from None
    if not any(content.strip() for _, content in found):
        raise InputError(path, f"no table in the zip; it has {', '.join(names[:8]) or 'nothing'}", remedy=EXPORT)
    return found


def _table(path: str, stem: str, content: bytes) -> Table:
    """Return a table with comma, semicolon or tab between cells and point or comma before decimals."""
    import pandas as pd  # noqa: PLC0415 - a second to import

    if content.startswith(b"\xd0\xcf\x11\xe0"):
        raise InputError(path, "is an Excel file", remedy=EXPORT)
    lines = [line for line in text_of(path, content, remedy=EXPORT).splitlines() if line.strip() and line[0] != "#"]
    if not lines:
        raise InputError(path, "is empty, no row", remedy=EXPORT)
    mark = max("\t;,", key=lines[0].count)
    comma = mark != "," and any("," in line for line in lines[1:20])
    head, *rows = (line.rstrip(mark) for line in lines)
    names, first = (next(csv.reader([line], delimiter=mark)) for line in (head, rows[0] if rows else ""))
    problem = None
    frame = pd.DataFrame(columns=names)
    if len(first) > len(names):
        problem = f"{len(first)} cells in the first row, {len(names)} in the head, with '{mark}' between them"
    else:
        try:
            text = "\n".join([head, *rows])
            frame = pd.read_csv(StringIO(text), sep=mark, decimal="," if comma else ".", index_col=False)
        except (ValueError, pd.errors.ParserError) as wrong:
            problem = f"is no table ({' '.join(str(wrong).split())[:120]})"
    return Table(path, stem, frame.rename(columns=lambda name: str(name).strip().strip('"')), problem)
