"""The closed table of log messages: our own protobuf messages, and Foxglove's where one fits.

A stage gives a message as a plain mapping; ``encode`` turns it into protobuf bytes and accepts exactly the fields of
the table, all of them, because proto3 cannot tell a field that was left out from a zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.timestamp_pb2 import Timestamp

OWN_MESSAGES: dict[str, str] = {
    "Weights": "demonstration:string coordinate:string centers:double[] values:double[]",
    "AdaptRollout": (
        "index:int64 tau_scale:double signed_miss_m:double caught:bool amplitude:double "
        "shift_x_m:double shift_y_m:double"
    ),
    "AdaptWindow": "index:int64 low:double high:double middle:double",
    "AdaptRepeat": "index:int64 caught:bool miss_m:double",
    "Rollout": (
        "index:int64 explored:bool reward:double success:bool duration_s:double peak_displacement_m:double "
        "half_swings:int64"
    ),
    "QTable": "rollout:int64 rows:int64 columns:int64 values:double[]",
    "SwingState": (
        "x_m:double velocity_m_s:double angle_rad:double rate_rad_s:double action_m_s2:double tension_n:double"
    ),
    "Detection": "flight:int64 camera:string u_px:double v_px:double radius_px:double seen:bool",
    "CatchEstimate": (
        "flight:int64 t_catch_s:double x_m:double y_m:double z_m:double "
        "velocity_x_m_s:double velocity_y_m_s:double velocity_z_m_s:double "
        "sigma_t_s:double sigma_x_m:double sigma_y_m:double sigma_z_m:double"
    ),
    "PredictionError": "flight:int64 horizon_ms:double position_error_mm:double time_error_ms:double",
    "TransferStep": (
        "rollout:int64 x_m:double velocity_m_s:double angle_rad:double rate_rad_s:double action_m_s2:double"
    ),
    "Game": (
        "index:int64 swung_up:bool predicted:bool caught:bool prediction_error_mm:double outcome:string since_s:double "
        "free_s:double frames:int64 seen:int64 latency_frames:double blow_n:double "
        "crossing_s:double crossing_m:double[]"
    ),
    "GameEstimate": (
        "game:int64 t_catch_s:double sigma_t_s:double x_m:double y_m:double z_m:double "
        "velocity_x_m_s:double velocity_y_m_s:double velocity_z_m_s:double covariance_m2:double[]"
    ),
    "Wrench": (
        "force_x_n:double force_y_n:double force_z_n:double torque_x_nm:double torque_y_nm:double torque_z_nm:double"
    ),
    "Contact": "step:string body:string wanted_n:double along_n:double across_n:double",
    "JointFriction": "joint:string velocity_rad_s:double friction_nm:double parametric_nm:double network_nm:double",
}
"""Our messages, package ``kendama``: ``name:type`` in the order of the field numbers; append, never reorder."""

_KINDS = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "int64": FieldDescriptorProto.TYPE_INT64,
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "string": FieldDescriptorProto.TYPE_STRING,
    "bytes": FieldDescriptorProto.TYPE_BYTES,
}
_CONVERT: dict[str, Callable[[Any], Any]] = {"double": float, "int64": int, "bool": bool, "string": str, "bytes": bytes}


class LogSchemaError(KeyError):
    """A stage wrote to a topic or field that the closed tables do not have: a mistake in the program."""

    def __str__(self) -> str:
        """Return the message itself: KeyError would quote it."""
        return str(self.args[0])


def _own_file() -> FileDescriptorProto:
    """The file descriptor ``kendama/messages.proto`` for OWN_MESSAGES."""
    file = FileDescriptorProto(name="kendama/messages.proto", package="kendama", syntax="proto3")
    for name, fields in OWN_MESSAGES.items():
        message = file.message_type.add(name=name)
        for number, field in enumerate(fields.split(), start=1):
            field_name, kind = field.split(":")
            label = FieldDescriptorProto.LABEL_REPEATED if kind.endswith("[]") else FieldDescriptorProto.LABEL_OPTIONAL
            message.field.add(name=field_name, number=number, type=_KINDS[kind.removesuffix("[]")], label=label)
    return file


_POOL = DescriptorPool()
_POOL.Add(_own_file())


def _double_list(values: Any) -> list[float]:
    return [float(value) for value in values]


def _own_encoder(name: str) -> Callable[[Mapping[str, Any], int], Message]:
    """The encoder of one of our messages: a plain mapping of exactly its fields."""
    fields = dict(field.split(":") for field in OWN_MESSAGES[name].split())
    convert = {field: _double_list if kind == "double[]" else _CONVERT[kind] for field, kind in fields.items()}
    made: type[Message] = GetMessageClass(_POOL.FindMessageTypeByName(f"kendama.{name}"))
    names = convert.keys()

    def encode_own(message: Mapping[str, Any], t_ns: int) -> Message:
        _check(message, names, names)
        return made(**{field: convert[field](value) for field, value in message.items()})

    return encode_own


def _frame_transform(message: Mapping[str, Any], t_ns: int) -> Message:
    _check(message, _FRAME_FIELDS, _FRAME_REQUIRED)
    x, y, z = message["position_m"]
    rotation = message.get("rotation_wxyz")
    qw, qx, qy, qz = (1.0, 0.0, 0.0, 0.0) if rotation is None else rotation
    return FrameTransform(
        timestamp=_stamp(t_ns),
        parent_frame_id=message["parent"],
        child_frame_id=message["child"],
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
    )


def _joint_states(message: Mapping[str, Any], t_ns: int) -> Message:
    _check(message, _JOINT_COLUMNS.keys() | {"names"}, {"names", "position_rad"})
    joints = [JointState(name=name) for name in message["names"]]
    for column, field in _JOINT_COLUMNS.items():
        values = message.get(column)
        if values is None:
            continue
        for joint, value in zip(joints, values, strict=True):
            setattr(joint, field, float(value))
    return JointStates(timestamp=_stamp(t_ns), joints=joints)


def _compressed_image(message: Mapping[str, Any], t_ns: int) -> Message:
    _check(message, _IMAGE_FIELDS, _IMAGE_FIELDS)
    return CompressedImage(
        timestamp=_stamp(t_ns), frame_id=message["frame"], format=message["format"], data=bytes(message["data"])
    )


_FRAME_REQUIRED = frozenset({"parent", "child", "position_m"})
_FRAME_FIELDS = _FRAME_REQUIRED | {"rotation_wxyz"}
_IMAGE_FIELDS = frozenset({"frame", "format", "data"})
_JOINT_COLUMNS = {"position_rad": "position", "velocity_rad_s": "velocity", "effort_nm": "effort"}

_FOXGLOVE: dict[str, type[Message]] = {
    "foxglove.FrameTransform": FrameTransform,
    "foxglove.JointStates": JointStates,
    "foxglove.CompressedImage": CompressedImage,
}
_ENCODERS: dict[str, Callable[[Mapping[str, Any], int], Message]] = {
    "foxglove.FrameTransform": _frame_transform,
    "foxglove.JointStates": _joint_states,
    "foxglove.CompressedImage": _compressed_image,
    **{f"kendama.{name}": _own_encoder(name) for name in OWN_MESSAGES},
}
SCHEMAS: tuple[str, ...] = tuple(_ENCODERS)
"""The names of all schemas that a channel can have."""


def encode(schema: str, message: Mapping[str, Any], t_ns: int) -> bytes:
    """Protobuf bytes of ``message`` under ``schema``; ``t_ns`` fills the time stamp where the schema has one.

    Raises LogSchemaError, naming the field, for a field that is unknown, missing or of the wrong type or length.
    """
    try:
        return _ENCODERS[schema](message, t_ns).SerializeToString(deterministic=True)
    except (TypeError, ValueError) as wrong:
        raise LogSchemaError(f"{schema}: a field has the wrong type or length ({wrong}) in {dict(message)!r}") from None
    except LogSchemaError as wrong:
        raise LogSchemaError(f"{schema}: {wrong}") from None


@cache
def file_descriptor_set(schema: str) -> bytes:
    """The serialized FileDescriptorSet of ``schema`` with all files that it depends on, dependencies first."""
    root: Any = (_FOXGLOVE[schema].DESCRIPTOR if schema in _FOXGLOVE else _POOL.FindMessageTypeByName(schema)).file
    files: dict[str, FileDescriptorProto] = {}
    _collect(root, files)
    return FileDescriptorSet(file=files.values()).SerializeToString(deterministic=True)


def _collect(file: FileDescriptor, files: dict[str, FileDescriptorProto]) -> None:
    """Add ``file`` to ``files`` after all that it depends on."""
    for dependency in file.dependencies:
        _collect(dependency, files)
    if file.name not in files:
        plain = FileDescriptorProto()
        file.CopyToProto(plain)
        files[file.name] = plain


def _stamp(t_ns: int) -> Timestamp:
    seconds, nanos = divmod(t_ns, 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanos)


def _check(message: Mapping[str, Any], allowed: Any, required: Any) -> None:
    """Raise LogSchemaError unless ``required`` <= the message's fields <= ``allowed``."""
    fields = message.keys()
    if fields == required:
        return
    if unknown := sorted(fields - allowed):
        raise LogSchemaError(f"unknown field {', '.join(map(repr, unknown))}; it has {', '.join(sorted(allowed))}")
    if missing := sorted(required - fields):
        raise LogSchemaError(f"field {', '.join(map(repr, missing))} is missing")
