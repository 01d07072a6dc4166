"""Logs made up for tests, on files in memory."""

from __future__ import annotations

import importlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from kendama_cli.log.writer import McapLog
from kendama_cli.schema.messages import kind_of

STAGES = ("capture", "encode", "identify", "adapt", "learn", "predict", "transfer", "rehearse")


def all_topics() -> dict[str, type]:
    """What the built-in stages declare, together."""
    modules = [importlib.import_module(f"kendama_cli.stages.{name}.messages") for name in STAGES]
    return {topic: kind for module in modules for topic, kind in module.TOPICS.items()}


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
