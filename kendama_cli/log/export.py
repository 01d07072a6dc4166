"""Work of ``kendama log``: describe an MCAP file, and export it to Parquet and CSV.

One row per message: ``topic``, ``t_s``, then the fields. A file with several topics becomes one table that has the
fields of all topics, empty where a topic lacks one; with ``topic`` only that topic and its own fields. Where ``out``
is a folder (no suffix, or one that exists), every topic becomes a Parquet file of its own in it.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Collection
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from kendama_cli.errors import InputError, StoreError, UsageError
from kendama_cli.log.reader import LogFile

SUFFIXES = (".parquet", ".csv")


def describe(path: Path | str) -> dict[str, Any]:
    """Return what an MCAP file holds (LogFile.describe), every byte of it checked; raises InputError."""
    return LogFile(path, topics=()).describe()


def export(path: Path | str, out: Path | str | None = None, topic: str | None = None) -> list[Path]:
    """Export the log ``path`` and return the files written; ``out`` defaults to the log's name with .parquet here.

    Raises InputError for a log that cannot be read, UsageError for a suffix that is neither .parquet nor .csv, and
    StoreError where ``out`` cannot be written.
    """
    target = Path(out) if out is not None else Path(f"{Path(path).stem}.parquet")
    folder = target.is_dir() or not target.suffix
    if not folder and target.suffix.lower() not in SUFFIXES:
        raise UsageError(
            f"cannot export to '{target}': the suffix '{target.suffix}' is unknown; use .parquet, .csv, or a folder"
        )
    log = LogFile(path, None if topic is None else (topic,))
    topics = log.topics if topic is None else (topic,)
    if not topics:
        raise InputError(str(path), "it has no channel, so there is nothing to export")
    tables = {name: _table(log, name) for name in topics}
    try:
        if not folder:
            return [_write(_union(list(tables.values())), target)]
        target.mkdir(parents=True, exist_ok=True)
        return [
            _write(table, target / f"{name.strip('/').replace('/', '_') or 'root'}.parquet")
            for name, table in tables.items()
        ]
    except OSError as wrong:
        raise StoreError(str(target), f"cannot write '{target}': {wrong.strerror or wrong}") from None


def _table(log: LogFile, topic: str) -> pa.Table:
    """Return one topic as an Arrow table with its name in front; values that Arrow has no type for become JSON text."""
    frame = log.table(topic)
    if "topic" in frame:
        frame = frame.rename(columns={"topic": "message.topic"})
    frame.insert(0, "topic", topic)
    columns = {}
    for name in frame.columns:
        values = frame[name]
        try:
            columns[str(name)] = pa.Array.from_pandas(values)
        except (pa.ArrowInvalid, pa.ArrowTypeError, pa.ArrowNotImplementedError):
            columns[str(name)] = pa.array([_text(value) for value in values], pa.string())
    return pa.table(columns)


def _union(tables: list[pa.Table]) -> pa.Table:
    """Return all rows under one another; a field that has different types in different topics becomes text."""
    try:
        return pa.concat_tables(tables, promote_options="permissive")
    except (pa.ArrowInvalid, pa.ArrowTypeError):
        kinds: dict[str, set[str]] = {}
        for table in tables:
            for column in table.schema:
                kinds.setdefault(column.name, set()).add(str(column.type))
        mixed = {name for name, types in kinds.items() if len(types) > 1}
        return pa.concat_tables([_as_text(table, mixed) for table in tables], promote_options="permissive")


def _as_text(table: pa.Table, names: Collection[str]) -> pa.Table:
    for number, name in enumerate(table.column_names):
        if name in names:
            text = pa.array([_text(value) for value in table.column(number).to_pylist()], pa.string())
            table = table.set_column(number, name, text)
    return table


def _write(table: pa.Table, target: Path) -> Path:
    if target.suffix.lower() == ".csv":
        nested = [c.name for c in table.schema if pa.types.is_nested(c.type) or pa.types.is_binary(c.type)]
        pyarrow.csv.write_csv(_as_text(table, nested), target)
    else:
        pyarrow.parquet.write_table(table, target, compression="zstd")
    return target


def _text(value: Any) -> str | None:
    """Return the JSON of a list or dict, base64 of bytes, nothing for nothing."""
    if value is None or value is pd.NA or (isinstance(value, float) and math.isnan(value)):
        return None
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    return value if isinstance(value, str) else json.dumps(value, default=_text)
