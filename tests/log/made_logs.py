"""Logs made up for tests, on files in memory."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from kendama_cli.log.writer import McapLog
from kendama_cli.schema.declaration import find_stage, stage_names
from kendama_cli.schema.messages import kind_of


def all_topics() -> dict[str, type]:
    """Return what the installed stages declare, together; those of parts too."""
    stages = [stage for name in stage_names() if (stage := find_stage(name)) is not None]
    return {topic: kind for stage in stages for topic, kind in stage.topics.items()}


class MemoryFile:
    """An AppendFile that no disk holds."""

    def __init__(self) -> None:
        self.content = bytearray()

    def write(self, data: bytes) -> None:
        self.content += data

    def cut(self, size: int) -> None:
        del self.content[size:]

    def reader(self) -> BinaryIO:
        return io.BytesIO(bytes(self.content))


def memory_log() -> McapLog:
    """A log in memory that takes every topic of the built-in stages."""
    return McapLog(all_topics(), MemoryFile())


class FieldLog:
    """The same, for messages that are given by their fields."""

    def __init__(self) -> None:
        self._topics = all_topics()
        self._log = McapLog(self._topics, MemoryFile())

    def write(self, topic: str, t_s: float, fields: Mapping[str, Any]) -> None:
        self._log.write(topic, t_s, kind_of(self._topics, topic)(**fields))

    def finish(self, path: Path, **facts: Any) -> None:
        self._log.finish(path, **facts)
