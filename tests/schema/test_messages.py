"""The closed tables: exactly their topics and fields, everything else is a mistake that is named."""

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet

from kendama_cli.log.channels import CHANNELS, FAMILIES, schema_of
from kendama_cli.log.decode import message_class
from kendama_cli.schema.messages import OWN_MESSAGES, SCHEMAS, LogSchemaError, encode, file_descriptor_set

STATE = {
    "x_m": 0.1,
    "velocity_m_s": -0.2,
    "angle_rad": 3.0,
    "rate_rad_s": 0.0,
    "action_m_s2": 8.0,
    "tension_n": 0.5,
}
EXAMPLE = {
    "double": 1.5,
    "int64": -3,
    "bool": True,
    "string": "left",
    "bytes": b"\x00\xff",
    "double[]": [1.0, -0.0, 2.5],
}


def test_every_channel_has_a_schema_that_can_be_encoded():
    assert {*CHANNELS.values(), *FAMILIES.values()} == set(SCHEMAS)


@pytest.mark.parametrize("name", OWN_MESSAGES)
def test_every_own_message_survives_the_round_trip_through_its_embedded_descriptor(name):
    fields = dict(field.split(":") for field in OWN_MESSAGES[name].split())
    message = {field: EXAMPLE[kind] for field, kind in fields.items()}
    schema = f"kendama.{name}"
    read = message_class(schema, file_descriptor_set(schema)).FromString(encode(schema, message, 0))
    assert {
        field: list(v) if fields[field] == "double[]" else v for field in fields for v in [getattr(read, field)]
    } == message


@pytest.mark.parametrize("schema", SCHEMAS)
def test_descriptor_sets_hold_every_file_after_its_dependencies(schema):
    seen = set()
    for file in FileDescriptorSet.FromString(file_descriptor_set(schema)).file:
        assert set(file.dependency) <= seen
        seen.add(file.name)


def test_numpy_scalars_and_arrays_are_accepted():
    message = {name: np.float32(value) for name, value in STATE.items()}
    assert encode("kendama.SwingState", message, 0)
    table = {"rollout": np.int64(1), "rows": np.int32(1), "columns": 2, "values": np.array([1.0, 2.0])}
    assert encode("kendama.QTable", table, 0)


def test_an_unknown_topic_is_a_key_error_that_names_it():
    with pytest.raises(KeyError) as caught:
        schema_of("/learn/rollouts")
    assert str(caught.value).startswith("unknown log topic '/learn/rollouts'; kendama_cli/log/channels.py has ")


def test_a_family_takes_one_name_and_no_deeper_topic():
    assert schema_of("/predict/image/left") == "foxglove.CompressedImage"
    for topic in ("/predict/image/", "/predict/image/left/raw", "/predict/image"):
        with pytest.raises(LogSchemaError):
            schema_of(topic)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"x": 1.0}, "kendama.SwingState: unknown field 'x'; it has action_m_s2, angle_rad"),
        ({"x_m": None}, "kendama.SwingState: a field has the wrong type or length"),
        ({"x_m": "wide"}, "kendama.SwingState: a field has the wrong type or length"),
    ],
)
def test_an_unknown_or_wrong_field_is_named(change, told):
    with pytest.raises(LogSchemaError) as caught:
        encode("kendama.SwingState", {**STATE, **change}, 0)
    assert str(caught.value).startswith(told)


def test_a_missing_field_is_named_because_proto3_would_read_it_as_zero():
    with pytest.raises(LogSchemaError, match=r"kendama.SwingState: field 'tension_n' is missing"):
        encode("kendama.SwingState", {name: value for name, value in STATE.items() if name != "tension_n"}, 0)


@pytest.mark.parametrize(
    ("schema", "message"),
    [
        ("foxglove.FrameTransform", {"parent": "world", "child": "cup", "position_m": (1.0, 2.0)}),
        ("foxglove.JointStates", {"names": ["a", "b"], "position_rad": [0.0]}),
        ("foxglove.CompressedImage", {"frame": "left", "format": "jpeg", "data": "text"}),
    ],
)
def test_wrong_lengths_and_types_in_foxglove_messages_are_refused(schema, message):
    with pytest.raises(LogSchemaError, match=f"{schema}: a field has the wrong type or length"):
        encode(schema, message, 0)
