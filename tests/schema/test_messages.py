"""Protobuf of message dataclasses: values there and back, types that fit nothing named in one line."""

from __future__ import annotations

import keyword
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, make_dataclass

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kendama_cli.errors import LogMessageError
from kendama_cli.log.decode import message_class
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform, JointStates
from kendama_cli.schema.messages import codec, kind_of


@dataclass(frozen=True)
class StateMessage:
    x_m: float
    index: int
    seen: bool
    name: str
    data: bytes
    values: Collection[float]


STATE = StateMessage(0.1, -3, True, "left", b"\x00\xff", (1.0, -0.0, 2.5))

SCALARS = {
    float: st.floats(),
    int: st.integers(-(2**63), 2**63 - 1),
    bool: st.booleans(),
    str: st.text(st.characters(exclude_categories=["Cs"])),  # protobuf holds UTF-8, which has no lone surrogates
    bytes: st.binary(),
}
NAMES = st.from_regex(r"\A[a-z][a-z0-9]{0,6}\Z").filter(lambda name: not keyword.iskeyword(name))


@st.composite
def messages(draw: st.DrawFn) -> object:
    """A message of a dataclass of random fields."""
    fields, values = [], []
    for name in draw(st.lists(NAMES, unique=True, max_size=6)):
        scalar = draw(st.sampled_from(list(SCALARS)))
        if draw(st.booleans()):
            shape = draw(st.sampled_from([tuple[scalar, ...], Sequence[scalar], Collection[scalar], list[scalar]]))
            fields.append((name, shape))
            values.append(tuple(draw(st.lists(SCALARS[scalar], max_size=4))))
        else:
            fields.append((name, scalar))
            values.append(draw(SCALARS[scalar]))
    kind = make_dataclass("DrawnMessage", fields, frozen=True, namespace={"__module__": "lab.messages"})
    return kind(*values)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(messages())
def test_every_message_comes_back_to_the_bit(message):
    made = codec(type(message))
    read = made.decode(made.encode(message, 0))
    assert type(read) is type(message)
    assert repr(read) == repr(message), "text tells -0.0 from 0.0, and nan equals itself in it"
    assert made.encode(read, 0) == made.encode(message, 0)


@given(st.lists(st.floats(), min_size=3, max_size=3), st.lists(st.floats(), min_size=4, max_size=4), st.text("abü☃"))
def test_transforms_come_back_to_the_bit(position_m, rotation_wxyz, child):
    message = FrameTransform("world", child, tuple(position_m), tuple(rotation_wxyz))
    made = codec(FrameTransform)
    assert repr(made.decode(made.encode(message, 1_500_000_000))) == repr(message)


@given(st.lists(st.tuples(st.text("ab1"), st.floats(), st.floats(), st.floats()), min_size=1, max_size=8))
def test_joints_come_back_with_the_columns_that_were_measured(joints):
    names, position, velocity, effort = zip(*joints, strict=True)
    made = codec(JointStates)
    for message in (JointStates(names, position), JointStates(names, position, velocity, effort)):
        assert repr(made.decode(made.encode(message, 0))) == repr(message)


def test_the_embedded_descriptor_alone_reads_the_bytes():
    made = codec(StateMessage)
    assert made.schema == "tests.State"
    read = message_class(made.schema, made.descriptor_set).FromString(made.encode(STATE, 0))
    assert [field.name for field in read.DESCRIPTOR.fields] == ["x_m", "index", "seen", "name", "data", "values"]
    assert [field.number for field in read.DESCRIPTOR.fields] == [1, 2, 3, 4, 5, 6]
    assert (read.x_m, read.index, read.name, list(read.values)) == (0.1, -3, "left", [1.0, 0.0, 2.5])


@pytest.mark.parametrize("kind", [FrameTransform, JointStates, CompressedImage])
def test_descriptor_sets_hold_every_file_after_its_dependencies(kind):
    seen = set()
    for file in FileDescriptorSet.FromString(codec(kind).descriptor_set).file:
        assert set(file.dependency) <= seen
        seen.add(file.name)


def test_numpy_scalars_and_arrays_are_accepted():
    message = StateMessage(np.float32(0.5), np.int64(-3), np.bool_(True), "left", b"", np.array([1.0, 2.0]))
    assert codec(StateMessage).decode(codec(StateMessage).encode(message, 0)) == StateMessage(
        0.5, -3, True, "left", b"", (1.0, 2.0)
    )


@pytest.mark.parametrize(
    "change",
    [
        {"x_m": None},
        {"x_m": "wide"},
        {"index": 2.5},
        {"index": 2**63},
        {"name": 3},
        {"name": "\ud800"},
        {"data": "text"},
        {"values": 1.0},
        {"values": [None]},
        {"values": np.zeros((2, 2))},
    ],
    ids=str,
)
def test_a_field_of_the_wrong_type_is_refused_in_one_line(change):
    message = StateMessage(**(vars(STATE) | change))
    with pytest.raises(LogMessageError, match="a field of StateMessage has the wrong type or length") as caught:
        codec(StateMessage).encode(message, 0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "message",
    [
        FrameTransform("world", "cup", (1.0, 2.0)),
        FrameTransform("world", "cup", (1.0, 2.0, None)),
        JointStates(["a", "b"], [0.0]),
        CompressedImage("left", "jpeg", "text"),
    ],
)
def test_wrong_lengths_and_types_in_foxglove_messages_are_refused(message):
    with pytest.raises(LogMessageError, match=f"a field of {type(message).__name__} has the wrong type or length"):
        codec(type(message)).encode(message, 0)


@dataclass(frozen=True)
class NestedMessage:
    parts: dict[str, float]


def test_a_field_that_proto3_cannot_hold_names_what_it_can():
    with pytest.raises(LogMessageError, match=r"field 'parts' of log message NestedMessage is a dict.*allowed: float"):
        codec(NestedMessage)
    with pytest.raises(LogMessageError, match="log message int is no dataclass; declare it as a frozen one"):
        codec(int)


def test_a_star_takes_one_name_and_no_deeper_topic():
    topics = {"/predict/image/*": CompressedImage, "/predict/ball": FrameTransform}
    assert kind_of(topics, "/predict/image/left") is CompressedImage
    for topic in ("/predict/image/", "/predict/image/left/raw", "/predict/image", "/predict/image/*", "/ball"):
        with pytest.raises(LogMessageError, match=r"it declares /predict/ball, /predict/image/\*: add it to"):
            kind_of(topics, topic)


def test_nan_and_negative_zero_are_numbers_like_others():
    read = codec(StateMessage).decode(codec(StateMessage).encode(StateMessage(-0.0, 0, False, "", b"", (math.nan,)), 0))
    assert math.copysign(1, read.x_m) == -1
    assert math.isnan(next(iter(read.values)))
