"""Work of ``kendama log``: describe an MCAP file, and export it to Parquet and CSV.

One row per message: ``topic``, ``t_s``, then the fields. A file with several topics becomes one table that has the
fields of all topics, empty where a topic lacks one; with ``topic`` only that topic and its own fields. Where ``out``
is a folder (no suffix, or one that exists), every topic becomes a Parquet file of its own in it.
"""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import pandas as pd

from kendama_cli.errors import InputError, StoreError, UsageError, no_pyarrow
from kendama_cli.log.reader import LogFile

SUFFIXES = (".parquet", ".csv")


def describe(path: Path | str) -> dict[str, Any]:
    """Return what an MCAP file holds (LogFile.describe), every byte of it checked; raises InputError."""
    return LogFile(path, topics=()).describe()


def export(path: Path | str, out: Path | str | None = None, topic: str | None = None) -> list[Path]:
    """Export the log ``path`` and return the files written; ``out`` defaults to the log's name with .csv here.

    Raises InputError for a log that cannot be read, UsageError for a suffix that is neither .parquet nor .csv, and
    StoreError where ``out`` cannot be written, and MissingPartError for Parquet without the extra ``parquet``.
    """
    target = Path(out) if out is not None else Path(f"{Path(path).stem}.csv")
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
            return [_write(pd.concat(tables.values(), ignore_index=True), target)]
        target.mkdir(parents=True, exist_ok=True)
        return [
            _write(table, target / f"{name.strip('/').replace('/', '_') or 'root'}.parquet")
            for name, table in tables.items()
        ]
    except OSError as wrong:
        raise StoreError(str(target), f"cannot write '{target}': {wrong.strerror or wrong}") from None


def _table(log: LogFile, topic: str) -> pd.DataFrame:
    """Return one topic with its name in front; whole numbers stay whole where another topic lacks the field."""
    frame = log.table(topic)
    if "topic" in frame:
        frame = frame.rename(columns={"topic": "message.topic"})
    frame.insert(0, "topic", topic)
    nullable = {"i": "Int64", "u": "UInt64", "b": "boolean"}
    return frame.astype({name: nullable[kind] for name in frame if (kind := frame[name].dtype.kind) in nullable})


def _write(frame: pd.DataFrame, target: Path) -> Path:
    if target.suffix.lower() == ".csv":
        _as_text(frame).to_csv(target, index=False)
        return target
    try:
        frame.to_parquet(target, engine="pyarrow", compression="zstd", index=False)
    except ImportError:
        raise no_pyarrow(f"'{target}'", "or name the file .csv") from None
    except (ValueError, TypeError, NotImplementedError):  # Arrow has no type for values of several kinds
        _as_text(frame).to_parquet(target, engine="pyarrow", compression="zstd", index=False)
    return target


def _as_text(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the table with JSON in the place of lists, and base64 in the place of bytes."""
    frame = frame.copy()
    for name in [one for one in frame if frame[one].dtype.kind == "O"]:
        frame[name] = frame[name].map(_text, na_action="ignore")
    return frame


def _text(value: Any) -> str:
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    return value if isinstance(value, str) else json.dumps(value, default=_text)
