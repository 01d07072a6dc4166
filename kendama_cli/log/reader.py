"""Reads MCAP logs, our own and foreign ones, into tables."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError, FormatError, InputError
from kendama_cli.log.container import ChannelContent, read_container
from kendama_cli.log.container_writer import FORMAT, LIBRARY
from kendama_cli.log.decode import UndecodableError, check_schema, decode, decode_as
from kendama_cli.log.writer import METRICS, STAGE_METADATA, is_metric
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build

M = TypeVar("M")
T = TypeVar("T")


@dataclass(frozen=True)
class TypedMessages(Generic[M]):
    """Messages in order of time: a type checker sees a mistyped field wherever they are read."""

    t_s: Array
    """(n,), log times"""
    messages: tuple[M, ...]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.messages)

    def column(self, of: Callable[[M], object]) -> NDArray[Any]:
        """Return ``of`` each message, (n,): ``rollouts.column(lambda rollout: rollout.reward)``."""
        return np.array([of(message) for message in self.messages])


class LogFile:
    """One MCAP file, read and checked whole on opening.

    ``topics`` limits what is kept in memory (None: all); every message is checked and counted nevertheless. Raises
    InputError for a file that is absent, cut short, damaged or no MCAP, FormatError for one of ours of another format.
    """

    def __init__(self, path: Path | str, topics: Collection[str] | None = None) -> None:
        self.path = Path(path)
        self._content = read_container(path, topics)
        name, _, number = self._content.library.partition(" log ")
        if name == LIBRARY and number != str(FORMAT):
            raise FormatError(str(path), "a log", number or "0", FORMAT)
        self._kept = topics

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that have a channel, sorted."""
        return tuple(sorted({channel.topic for channel in self._content.channels.values()}))

    @property
    def metadata(self) -> dict[str, dict[str, str]]:
        """The metadata records by name."""
        return dict(self._content.metadata)

    @property
    def stage(self) -> Mapping[str, Any]:
        """Stage, settings and metrics of a log of ours; empty for a foreign file.

        Raises InputError where they are not what a stage writes: settings by name, metrics that ``is_metric`` takes.
        """
        facts = self.metadata.get(STAGE_METADATA, {})
        if not facts.keys() >= {"stage", "settings", "metrics"}:
            return {}
        try:
            settings, metrics = (json.loads(facts[name]) for name in ("settings", "metrics"))
        except (ValueError, RecursionError) as wrong:
            raise InputError(str(self.path), f"its metadata '{STAGE_METADATA}' is no JSON ({wrong})") from None
        if not isinstance(settings, dict) or not isinstance(metrics, dict):
            raise InputError(str(self.path), f"its metadata '{STAGE_METADATA}' has no settings or metrics by name")
        for name, value in metrics.items():
            if not is_metric(value):
                problem = f"its metric '{name[:80]}' is a {type(value).__name__}; {METRICS}"
                raise InputError(str(self.path), problem, remedy="run the stage again with --force")
        return {"stage": facts["stage"], "settings": settings, "metrics": metrics}

    @property
    def time_range_s(self) -> tuple[float, float] | None:
        """The first and last log time in seconds; None without messages."""
        channels = [channel for channel in self._content.channels.values() if channel.count]
        if not channels:
            return None
        first = min(channel.first_ns or 0 for channel in channels)
        return first / 1e9, max(channel.last_ns or 0 for channel in channels) / 1e9

    def channel(self, topic: str) -> ChannelContent:
        """Return the channel of ``topic``; InputError, naming the topics that exist, where there is none."""
        found = [channel for channel in self._content.channels.values() if channel.topic == topic]
        if not found:
            there = ", ".join(self.topics) or "none at all"
            raise InputError(str(self.path), f"it has no topic '{topic}'", remedy=f"it has {there}")
        if self._kept is not None and topic not in self._kept:
            raise ValueError(f"topic '{topic}' was not among those kept on opening")
        first, *others = found
        if not others:
            return first
        messages = [message for channel in found for message in channel.messages]
        return ChannelContent(
            first.topic, first.encoding, first.schema_name, first.schema_encoding, first.schema_data, messages=messages
        )

    def table(self, topic: str, kind: type | None = None) -> pd.DataFrame:
        """Return the messages of one topic as a table.

        Parameters
        ----------
        topic : str
            One of ``topics``.
        kind : type, optional
            The message dataclass that the topic must have.

        Returns
        -------
        pandas.DataFrame
            A row per message in order of time: ``t_s`` [s] and a column per field, nested ones as ``outer.inner``.

        Raises
        ------
        InputError
            For a topic that is absent, whose messages cannot be decoded, or whose schema is not that of ``kind``.
        """
        channel = self.channel(topic)
        try:
            if kind is not None:
                check_schema(channel, kind)
            return decode(channel)
        except UndecodableError as wrong:
            raise InputError(str(self.path), str(wrong)) from None

    def messages(self, topic: str, kind: type[M]) -> TypedMessages[M]:
        """Return the messages of ``topic`` in order of time, as ``kind``.

        Raises InputError for a topic that is absent or whose schema is not that of ``kind``.
        """
        try:
            times_ns, messages = decode_as(self.channel(topic), kind)
        except UndecodableError as wrong:
            raise InputError(str(self.path), str(wrong)) from None
        return TypedMessages(np.array(times_ns, dtype=np.int64) / 1e9, tuple(messages))

    def describe(self) -> dict[str, Any]:
        """Return plain facts: size, stage, metrics, times; per channel schema, encoding, count, times and bytes."""
        span = self.time_range_s
        return {
            "path": str(self.path),
            "size_bytes": self.path.stat().st_size,
            "messages": self._content.messages_n,
            "chunks": self._content.chunks,
            "time_range_s": span,
            "duration_s": 0.0 if span is None else span[1] - span[0],
            **({"stage": self.stage["stage"], "metrics": self.stage["metrics"]} if self.stage else {}),
            "metadata": sorted(self.metadata),
            "channels": [
                {
                    "topic": channel.topic,
                    "schema": channel.schema_name,
                    "encoding": channel.encoding,
                    "messages": channel.count,
                    "first_s": None if channel.first_ns is None else channel.first_ns / 1e9,
                    "last_s": None if channel.last_ns is None else channel.last_ns / 1e9,
                    "bytes": channel.bytes_n,
                }
                for channel in sorted(self._content.channels.values(), key=lambda channel: channel.topic)
            ],
        }


def logged_settings(kind: type[T], value: Any, node: str, path: Path) -> T:
    """Return ``value``, the settings of ``node`` in the log at ``path``; raises InputError for another version's."""
    try:
        return build(kind, value, node)
    except ConfigError as wrong:
        problem = f"its settings '{node}' are of another version ({wrong})"
        raise InputError(str(path), problem, remedy="run the stage again") from None
