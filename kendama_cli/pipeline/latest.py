"""Latest key of each stage of a pipeline, so that a plan can say what has changed since; may be deleted."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kendama_cli.store import durable


def read_latest(home: Path, pipeline: str, stage: str) -> Any:
    """Return the ``key`` and ``parts`` that were stored last; None if there are none."""
    return durable.read_index(_path(home, pipeline, stage))


def keep_latest(home: Path, pipeline: str, stage: str, key: str | None, parts: Mapping[str, Any]) -> None:
    """Make ``key`` the one that the next plan compares with."""
    record = {"key": key, "parts": parts}
    path = _path(home, pipeline, stage)
    if durable.read_index(path) != record:
        durable.write_index(path, record)


def _path(home: Path, pipeline: str, stage: str) -> Path:
    return home / "index" / "latest" / pipeline / f"{stage}.json"
