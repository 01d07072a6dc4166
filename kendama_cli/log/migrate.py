"""A log by the names of today: topics, schemas, settings and metrics of an older version, message by message."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader

from kendama_cli.log.container_writer import ContainerWriter
from kendama_cli.log.reader import LogFile
from kendama_cli.log.writer import STAGE_METADATA, MemoryFile, canonical_json
from kendama_cli.schema.messages import OUR_PACKAGE
from kendama_cli.schema.renames import new_metrics, new_value, renamed, renamed_anywhere


def migrate_log(source: Path, target: Path) -> bool:
    """Write ``source`` by the names of today to ``target``; False, with nothing written, where it has them already.

    Messages keep their times, their order and, as fields are known by number, their bytes. Raises InputError where
    ``source`` is damaged, or no log.
    """
    before = LogFile(source)
    metadata = {name: _facts(values) if name == STAGE_METADATA else values for name, values in before.metadata.items()}
    writer = ContainerWriter(MemoryFile())
    schemas: dict[int, tuple[str, bytes]] = {}
    channels: dict[int, int] = {}
    changed = metadata != before.metadata
    with source.open("rb") as file:
        for record in StreamReader(file, validate_crcs=True).records:
            if isinstance(record, Schema):
                schemas[record.id] = _schema(record.name, record.data)
                changed |= schemas[record.id] != (record.name, record.data)
            elif isinstance(record, Channel) and record.id not in channels:
                topic = renamed_anywhere("topic", record.topic)
                changed |= topic != record.topic
                channels[record.id] = writer.add_channel(topic, *schemas[record.schema_id])
            elif isinstance(record, Message):
                writer.add(channels[record.channel_id], record.log_time, record.data)
    if changed:
        with target.open("wb") as file:
            writer.finish(file, metadata)
    return changed


def _facts(values: Mapping[str, str]) -> dict[str, str]:
    """Return stage, settings and metrics of a log by the names of today; as they are where they are no JSON."""
    made = dict(values)
    change: dict[str, Callable[[Any], Any]] = {
        "settings": lambda nodes: {node: new_value(node, value) for node, value in nodes.items()},
        "metrics": lambda metrics: new_metrics(values.get("stage", ""), metrics),
    }
    for name in change.keys() & values.keys():
        held = json.loads(values[name])
        if isinstance(held, dict):
            made[name] = canonical_json(change[name](held))
    return made


def _schema(name: str, data: bytes) -> tuple[str, bytes]:
    """Return the name and the descriptors of a message of ours by the names of today."""
    package, _, own = name.rpartition(".")
    if package != OUR_PACKAGE:
        return name, data
    new, files = renamed("message", "log", own) or own, FileDescriptorSet.FromString(data)
    for file in files.file:
        for message in file.message_type:
            if file.package == OUR_PACKAGE and message.name == own:
                file.name, message.name = f"{package}/{new}.proto", new
                for field in message.field:
                    field.name = renamed("field", new, field.name) or field.name
    return f"{package}.{new}", files.SerializeToString(deterministic=True)
