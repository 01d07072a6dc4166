"""Decoder of a channel's messages into a flat table, by the schema embedded in the file: protobuf or JSON."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import Default, DescriptorPool
from google.protobuf.message import DecodeError, Message
from google.protobuf.message_factory import GetMessageClass

from kendama_cli.log.container import ChannelContent
from kendama_cli.schema.messages import codec
from kendama_cli.schema.renames import renamed

M = TypeVar("M")

MIGRATE = "type 'kendama cache migrate', which rewrites the logs of a home by today's names"
_MESSAGE_TYPES = {10, 11}
_SPECIAL_COLUMNS: dict[str, tuple[str, ...]] = {
    "foxglove.FrameTransform": ("parent", "child", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"),
    "foxglove.JointStates": (),
    "foxglove.CompressedImage": ("frame_id", "format", "data"),
}


class UndecodableError(ValueError):
    """A channel's messages cannot be read; the text says why, without the file's name."""


def decode(channel: ChannelContent) -> pd.DataFrame:
    """Return the messages of ``channel`` in order of time: ``t_s``, then one column per field.

    Nested fields are joined with dots. A foxglove.FrameTransform becomes parent, child, x_m, y_m, z_m, qw, qx, qy,
    qz; a foxglove.JointStates becomes ``<joint>.position_rad`` and so on. Raises UndecodableError.
    """
    messages = sorted(channel.messages, key=lambda message: message[0])
    if channel.encoding == "protobuf" and channel.schema_encoding == "protobuf":
        frame = _protobuf(channel, [data for _, data in messages])
    elif channel.encoding == "json":
        frame = _json(channel, [data for _, data in messages])
    else:
        raise UndecodableError(
            f"topic '{channel.topic}' is encoded as '{channel.encoding}', only protobuf and json can be read"
        )
    t_s = np.array([t_ns for t_ns, _ in messages], dtype=np.int64) / 1e9
    if "t_s" in frame:
        frame = frame.rename(columns={"t_s": "message.t_s"})
    frame.insert(0, "t_s", t_s)
    return frame


def check_schema(channel: ChannelContent, kind: type) -> None:
    """Raise UndecodableError unless ``channel`` holds the fields of message dataclass ``kind``, as it declares them."""
    expected = codec(kind)
    if channel.schema_name == expected.schema and channel.schema_data != expected.descriptor_set:
        ours, theirs = (_fields(expected.schema, data) for data in (expected.descriptor_set, channel.schema_data))
        if ours != theirs:
            listed = ", ".join(name for name, *_ in theirs) or "none"
            message = expected.schema.rpartition(".")[2]
            renames = [(renamed("field", message, name) or name, *rest) for name, *rest in theirs] == ours
            remedy = MIGRATE if renames else "run the stage again ('kendama cross-check' for its log)"
            raise UndecodableError(
                f"the fields of {channel.schema_name} on topic '{channel.topic}' are not those of {kind.__name__} but "
                f"{listed}; it was logged by another version: {remedy}"
            )
    elif channel.schema_name != expected.schema:
        raise UndecodableError(
            f"topic '{channel.topic}' holds {channel.schema_name or 'messages without a schema'}, not {expected.schema}"
        )


def decode_as(channel: ChannelContent, kind: type[M]) -> tuple[list[int], list[M]]:
    """Decode times [ns] and messages of ``channel`` in order of time; raises UndecodableError unless a ``kind``."""
    check_schema(channel, kind)
    of_any: type = kind  # mypy takes type[M] for unhashable
    made = codec(of_any).decode
    times_ns, messages = [], []
    for number, (t_ns, data) in enumerate(sorted(channel.messages, key=lambda message: message[0])):
        times_ns.append(t_ns)
        try:
            messages.append(made(data))
        except DecodeError:
            raise UndecodableError(f"message {number} of topic '{channel.topic}' is no {channel.schema_name}") from None
    return times_ns, messages


def columns_of(kind: type) -> tuple[str, ...]:
    """Return the columns that a table of ``kind`` always has: those of joints are named after the joints."""
    return ("t_s", *_SPECIAL_COLUMNS.get(codec(kind).schema, tuple(field.name for field in dataclasses.fields(kind))))


def _fields(name: str, descriptor_set: bytes) -> list[tuple[str, int, int, bool]]:
    fields = message_class(name, descriptor_set).DESCRIPTOR.fields
    return [(field.name, field.number, field.type, field.is_repeated) for field in fields]


def message_class(name: str, descriptor_set: bytes) -> type[Message]:
    """Return the class of message ``name`` from a serialized FileDescriptorSet; UndecodableError where it does not hold
    it.
    """
    files = FileDescriptorSet()
    pool = DescriptorPool()
    try:
        files.ParseFromString(descriptor_set)
        by_name = {file.name: file for file in files.file}
        added: set[str] = set()
        for file in files.file:
            _add(pool, file, by_name, added)
        made: type[Message] = GetMessageClass(pool.FindMessageTypeByName(name))
        return made
    except (DecodeError, KeyError, TypeError, RecursionError) as wrong:
        raise UndecodableError(f"the schema '{name}' cannot be read ({wrong})") from None


def _add(
    pool: DescriptorPool, file: FileDescriptorProto, by_name: dict[str, FileDescriptorProto], added: set[str]
) -> None:
    """Add ``file`` to the pool after its dependencies; Google's own may be missing from the set."""
    if file.name in added:
        return
    added.add(file.name)
    for name in file.dependency:
        if name in by_name:
            _add(pool, by_name[name], by_name, added)
        elif name not in added:
            known = FileDescriptorProto()
            Default().FindFileByName(name).CopyToProto(known)
            _add(pool, known, by_name, added)
    pool.Add(file)


def _protobuf(channel: ChannelContent, messages: list[bytes]) -> pd.DataFrame:
    made = message_class(channel.schema_name, channel.schema_data)
    parsed = []
    for number, data in enumerate(messages):
        try:
            parsed.append(made.FromString(data))
        except DecodeError:
            raise UndecodableError(f"message {number} of topic '{channel.topic}' is no {channel.schema_name}") from None
    special = _SPECIAL.get(channel.schema_name)
    if special is not None:
        return special(parsed)
    fields = made.DESCRIPTOR.fields
    if not any(field.is_repeated or field.type in _MESSAGE_TYPES or field.has_presence for field in fields):
        return _columns([field.name for field in fields], [field.name for field in fields], parsed)
    return pd.DataFrame([_flat_message(message, "") for message in parsed])


def _columns(names: list[str], paths: list[str], parsed: list[Any]) -> pd.DataFrame:
    """Return one column per path, read attribute by attribute: ten times as fast as walking each message."""
    return pd.DataFrame(
        {name: [get(message) for message in parsed] for name, get in zip(names, map(attrgetter, paths), strict=True)}
    )


def _frame_transforms(parsed: list[Any]) -> pd.DataFrame:
    rotation = [f"rotation.{axis}" for axis in "wxyz"]
    paths = ["parent_frame_id", "child_frame_id", *(f"translation.{axis}" for axis in "xyz"), *rotation]
    return _columns(list(_SPECIAL_COLUMNS["foxglove.FrameTransform"]), paths, parsed)


def _joint_states(parsed: list[Any]) -> pd.DataFrame:
    units = {"position": "position_rad", "velocity": "velocity_rad_s", "effort": "effort_nm"}
    return pd.DataFrame(
        [
            {
                f"{joint.name}.{unit}": getattr(joint, part)
                for joint in message.joints
                for part, unit in units.items()
                if joint.HasField(part)
            }
            for message in parsed
        ]
    )


_SPECIAL: dict[str, Callable[[list[Any]], pd.DataFrame]] = {
    "foxglove.FrameTransform": _frame_transforms,
    "foxglove.JointStates": _joint_states,
}


def _flat_message(message: Any, prefix: str) -> dict[str, Any]:
    """Return field values by dotted name; a time stamp in seconds, an absent optional field left out."""
    if message.DESCRIPTOR.full_name in {"google.protobuf.Timestamp", "google.protobuf.Duration"}:
        return {f"{prefix.removesuffix('.')}_s": message.seconds + message.nanos * 1e-9}
    flat: dict[str, Any] = {}
    for field in message.DESCRIPTOR.fields:
        name = prefix + field.name
        if field.is_repeated:
            flat[name] = _repeated(field, getattr(message, field.name))
        elif field.type in _MESSAGE_TYPES:
            if message.HasField(field.name):
                flat |= _flat_message(getattr(message, field.name), f"{name}.")
        elif not field.has_presence or message.HasField(field.name):
            flat[name] = getattr(message, field.name)
    return flat


def _repeated(field: Any, values: Any) -> Any:
    if field.type not in _MESSAGE_TYPES:
        return list(values)
    if field.message_type.GetOptions().map_entry:
        held = field.message_type.fields_by_name["value"].type in _MESSAGE_TYPES
        return {str(key): _flat_message(value, "") if held else value for key, value in values.items()}
    return [_flat_message(value, "") for value in values]


def _json(channel: ChannelContent, messages: list[bytes]) -> pd.DataFrame:
    rows = []
    for number, data in enumerate(messages):
        try:
            value = json.loads(data)
        except ValueError as wrong:
            raise UndecodableError(f"message {number} of topic '{channel.topic}' is no JSON ({wrong})") from None
        rows.append(dict(_flat_json(value, "")) if isinstance(value, dict) else {"value": value})
    return pd.DataFrame(rows)


def _flat_json(value: dict[str, Any], prefix: str) -> Iterable[tuple[str, Any]]:
    for key, item in value.items():
        if isinstance(item, dict):
            yield from _flat_json(item, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", item
