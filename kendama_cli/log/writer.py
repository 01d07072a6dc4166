"""Writer of a stage's log: typed messages, streamed to disk, one deterministic MCAP file at the end."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from kendama_cli.errors import LogMessageError
from kendama_cli.log.container_writer import AppendFile, ContainerWriter
from kendama_cli.schema.json_text import json_text
from kendama_cli.schema.messages import codec, kind_of

STAGE_METADATA = "kendama.stage"
"""The MCAP metadata record with the keys stage, settings and metrics (both canonical JSON)."""

METRICS = "allowed: a number, text, yes or no, or nothing"


def is_metric(value: object) -> bool:
    """Return True for what may stand among a stage's metrics: a number that a float holds, text, a bool or None."""
    return value is None or isinstance(value, str | float | bool) or (isinstance(value, int) and abs(value) < 10**300)


_MAX_S = 9.2e9  # whole nanoseconds of more seconds do not fit 63 bits


class McapLog:
    """The LogWriter of a running stage, which may log the messages that it declares, by topic.

    Times are simulated or recorded time, never the wall clock. Messages stand in the file in the order of writing.
    """

    def __init__(self, topics: Mapping[str, type], file: AppendFile) -> None:
        self._topics = topics
        self._container = ContainerWriter(file)
        self._known: dict[str, tuple[type, Callable[[Any, int], bytes], int]] = {}

    def __len__(self) -> int:
        """Return how many messages were written or restored."""
        return self._container.messages_n

    def write(self, topic: str, t_s: float, message: Any) -> None:
        """Append one message at time ``t_s`` >= 0 [s].

        Raises LogMessageError for a topic that the stage does not declare, a message that is not of the topic's
        declared type, and a field that protobuf refuses.
        """
        kind, encode, channel = self._known.get(topic) or self._open(topic)
        if type(message) is not kind:
            raise LogMessageError(
                f"topic '{topic}' is declared to hold {kind.__name__}, but a {type(message).__name__} was logged; "
                f"log a {kind.__name__}, or declare the topic otherwise",
                topic,
            )
        if not 0.0 <= t_s < _MAX_S:
            raise LogMessageError(f"topic '{topic}': time must be finite and not negative, not {t_s!r} s", topic)
        t_ns = round(t_s * 1e9)
        try:
            data = encode(message, t_ns)
        except LogMessageError as wrong:
            raise LogMessageError(f"topic '{topic}': {wrong}", topic) from None
        self._container.add(channel, t_ns, data)

    def position(self) -> bytes:
        """Return where the log stands, for a checkpoint; the file must be made durable first."""
        return self._container.position()

    def restore(self, position: bytes) -> None:
        """Go on from ``position``; ValueError, with nothing changed, where the file is not as it was then."""
        self._container.restore(position)
        self._known = {}

    def finish(self, path: Path | str, *, stage: str, settings: Mapping[str, Any], metrics: Mapping[str, Any]) -> None:
        """Write the log with its summary to ``path``; nothing can be written afterwards.

        Equal messages, settings and metrics give equal bytes: no host, date or folder enters the file, and of an
        absolute path among the settings only the file's name stays. Raises OSError where the disk refuses.
        """
        facts = {"metrics": canonical_json(metrics), "settings": canonical_json(settings), "stage": stage}
        with Path(path).open("wb") as file:
            self._container.finish(file, {STAGE_METADATA: facts})

    def _open(self, topic: str) -> tuple[type, Callable[[Any, int], bytes], int]:
        kind = kind_of(self._topics, topic)
        found = codec(kind)
        channel = self._container.channels.get(topic)
        if channel is None:
            channel = self._container.add_channel(topic, found.schema, found.descriptor_set)
        self._known[topic] = kind, found.encode, channel
        return self._known[topic]


def canonical_json(value: Any) -> str:
    """Return JSON with sorted keys and no spaces; not finite numbers become null, absolute paths their last part."""
    return json_text(_plain(value))


def _plain(value: Any) -> Any:
    if isinstance(value, str):
        return Path(value).name if os.path.isabs(value) else value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict | Mapping):  # asking Mapping first costs a forked worker a copy of many pages
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # a numpy scalar or array
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


class MemoryFile:
    """See AppendFile."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def write(self, data: bytes) -> None:
        """Append ``data``."""
        self._bytes += data

    def cut(self, size: int) -> None:
        """Keep the first ``size`` bytes."""
        del self._bytes[size:]

    def reader(self) -> BinaryIO:
        """Return the file's content, from its start."""
        return io.BytesIO(bytes(self._bytes))
