"""Protobuf from a message's frozen dataclass: its schema, and its bytes there and back.

A field's annotation gives its proto3 type, its position in the class its number: append, never reorder. The schema is
named after the class without ``Message`` at its end, in the package that declares it. Foxglove's messages keep
Foxglove's schemas.
"""

from __future__ import annotations

import collections.abc
import dataclasses
import operator
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

from kendama_cli.errors import LogMessageError
from kendama_cli.schema.foxglove_protobuf import FOXGLOVE

OUR_PACKAGE = "kendama"

_PROTO_TYPES: dict[type, Any] = {
    float: FieldDescriptorProto.TYPE_DOUBLE,
    int: FieldDescriptorProto.TYPE_INT64,
    bool: FieldDescriptorProto.TYPE_BOOL,
    str: FieldDescriptorProto.TYPE_STRING,
    bytes: FieldDescriptorProto.TYPE_BYTES,
}
_COLLECTIONS = (tuple, list, collections.abc.Sequence, collections.abc.Collection, collections.abc.Iterable)


@dataclass(frozen=True)
class MessageCodec:
    """Encoder and decoder of one dataclass; ``encode`` also takes the log time in ns, for schemas that hold a time
    stamp.

    ``encode`` raises LogMessageError, saying what was given, for a field of the wrong type or length; ``decode``
    raises protobuf's DecodeError.
    """

    schema: str
    descriptor_set: bytes
    """The FileDescriptorSet of ``schema`` with all files that it depends on, dependencies first."""
    encode: Callable[[Any, int], bytes]
    decode: Callable[[bytes], Any]


@cache
def codec(kind: type) -> MessageCodec:
    """Return the codec of message dataclass ``kind``; raises LogMessageError where it has a field that proto3 cannot
    hold.
    """
    if kind in FOXGLOVE:
        foxglove = FOXGLOVE[kind]
        return MessageCodec(foxglove.schema, foxglove.descriptor_set, _refusing(kind, foxglove.encode), foxglove.decode)
    return _own_codec(kind)


def kind_of(topics: Mapping[str, type], topic: str) -> type:
    """Return the declared message type of ``topic``; a declared ``*`` at the end stands for one name.

    Raises LogMessageError, naming what is declared, where it is not.
    """
    parent, _, name = topic.rpartition("/")
    kind = topics.get(topic) or topics.get(f"{parent}/*")
    if kind is None or name in ("", "*"):
        declared = ", ".join(sorted(topics)) or "none"
        raise LogMessageError(
            f"the stage logs to topic '{topic}', which it does not declare; it declares {declared}: "
            "add it to the topics of its declaration",
            topic,
        )
    return kind


def _own_codec(kind: type) -> MessageCodec:
    package = kind.__module__.partition(".")[0]
    package = OUR_PACKAGE if package == "kendama_cli" else package
    name = kind.__name__.removesuffix("Message")
    file = FileDescriptorProto(name=f"{package}/{name}.proto", package=package, syntax="proto3")
    message = file.message_type.add(name=name)
    fields = _fields(kind)
    for number, (field, (scalar, many)) in enumerate(fields.items(), start=1):
        label = FieldDescriptorProto.LABEL_REPEATED if many else FieldDescriptorProto.LABEL_OPTIONAL
        message.field.add(name=field, number=number, type=_PROTO_TYPES[scalar], label=label)
    pool = DescriptorPool()
    pool.Add(file)
    made = GetMessageClass(pool.FindMessageTypeByName(f"{package}.{name}"))
    scalars = tuple(field for field, (_, many) in fields.items() if not many)
    repeated = tuple(field for field, (_, many) in fields.items() if many)
    values_of = _values_of(scalars)

    def encode(message: Any, t_ns: int) -> bytes:
        parts = dict(zip(scalars, values_of(message), strict=True))
        if None in parts.values():  # protobuf itself would leave the field out, and reading would return a zero
            raise TypeError(f"{' and '.join(field for field in parts if parts[field] is None)} is None")
        for field in repeated:
            values = getattr(message, field)
            parts[field] = values.tolist() if hasattr(values, "tolist") else list(values)
        return made(**parts).SerializeToString(deterministic=True)

    def decode(data: bytes) -> Any:
        read = made.FromString(data)
        values = {field: getattr(read, field) for field in fields}
        return kind(**values | {field: tuple(values[field]) for field in repeated})

    descriptor_set = FileDescriptorSet(file=[file]).SerializeToString(deterministic=True)
    return MessageCodec(f"{package}.{name}", descriptor_set, _refusing(kind, encode), decode)


def _values_of(names: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    """Return the reader of the attributes ``names``; attrgetter alone returns no tuple for one name."""
    if len(names) > 1:
        return operator.attrgetter(*names)
    return lambda message: tuple(getattr(message, name) for name in names)


def _fields(kind: type) -> dict[str, tuple[type, bool]]:
    """Return each field's scalar type and whether it holds many, in order; raises LogMessageError for any other
    type.
    """
    if not dataclasses.is_dataclass(kind):
        raise LogMessageError(f"log message {kind.__name__} is no dataclass; declare it as a frozen one")
    hints = typing.get_type_hints(kind)
    found = {}
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        origin, arguments = typing.get_origin(hint), typing.get_args(hint)
        many = origin in _COLLECTIONS and (origin is not tuple or arguments[1:] == (...,))
        scalar = arguments[0] if many else hint
        if scalar not in _PROTO_TYPES:
            raise LogMessageError(
                f"field '{field.name}' of log message {kind.__name__} is a {hint}; allowed: float, int, bool, str, "
                "bytes, and Sequence, Collection, list or tuple[..., ...] of one of them"
            )
        found[field.name] = (scalar, many)
    return found


def _refusing(kind: type, encode: Callable[[Any, int], bytes]) -> Callable[[Any, int], bytes]:
    """Return ``encode`` with protobuf's errors in one line."""

    def checked(message: Any, t_ns: int) -> bytes:
        try:
            return encode(message, t_ns)
        except (TypeError, ValueError, AttributeError) as wrong:
            given = " ".join(repr(message).split())
            given = given if len(given) <= 200 else f"{given[:200]}..."
            reason = " ".join(str(wrong).split())
            problem = f"a field of {kind.__name__} has the wrong type or length ({reason}): {given}"
            raise LogMessageError(problem) from None

    return checked
