"""Foxglove's protobuf schemas behind the light dataclasses of ``schema/foxglove.py``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from foxglove_schemas_protobuf import CompressedImage_pb2, FrameTransform_pb2, JointStates_pb2
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.timestamp_pb2 import Timestamp

from kendama_cli.schema.foxglove import CompressedImage, FrameTransform, JointStates

JOINT_COLUMNS: Mapping[str, Literal["position", "velocity", "effort"]] = {
    "position_rad": "position",
    "velocity_rad_s": "velocity",
    "effort_nm": "effort",
}
"""Field of JointStates -> field of foxglove.JointState."""


@dataclass(frozen=True)
class FoxgloveSchema:
    """One of Foxglove's schemas: its name, its descriptors, and the dataclass to its bytes (with t_ns) and back."""

    schema: str
    descriptor_set: bytes
    encode: Callable[[Any, int], bytes]
    decode: Callable[[bytes], Any]


def _frame_to_bytes(message: FrameTransform, t_ns: int) -> bytes:
    x, y, z = map(float, message.position_m)  # protobuf itself would take None for a zero
    qw, qx, qy, qz = map(float, message.rotation_wxyz)
    return FrameTransform_pb2.FrameTransform(
        timestamp=_stamp(t_ns),
        parent_frame_id=message.parent,
        child_frame_id=message.child,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
    ).SerializeToString(deterministic=True)


def _frame_from_bytes(data: bytes) -> FrameTransform:
    read = FrameTransform_pb2.FrameTransform.FromString(data)
    at, turn = read.translation, read.rotation
    return FrameTransform(
        read.parent_frame_id, read.child_frame_id, (at.x, at.y, at.z), (turn.w, turn.x, turn.y, turn.z)
    )


def _joints_to_bytes(message: JointStates, t_ns: int) -> bytes:
    joints = [JointState(name=name) for name in message.names]
    for column, field in JOINT_COLUMNS.items():
        values: Collection[float] | None = getattr(message, column)
        if values is None:
            continue
        for joint, value in zip(joints, values, strict=True):
            setattr(joint, field, float(value))
    return JointStates_pb2.JointStates(timestamp=_stamp(t_ns), joints=joints).SerializeToString(deterministic=True)


def _joints_from_bytes(data: bytes) -> JointStates:
    joints = JointStates_pb2.JointStates.FromString(data).joints
    columns = {
        column: tuple(getattr(joint, field) for joint in joints)
        for column, field in JOINT_COLUMNS.items()
        if column == "position_rad" or any(joint.HasField(field) for joint in joints)
    }
    return JointStates(names=tuple(joint.name for joint in joints), **columns)


def _image_to_bytes(message: CompressedImage, t_ns: int) -> bytes:
    return CompressedImage_pb2.CompressedImage(
        timestamp=_stamp(t_ns), frame_id=message.frame, format=message.format, data=message.data
    ).SerializeToString(deterministic=True)


def _image_from_bytes(data: bytes) -> CompressedImage:
    read = CompressedImage_pb2.CompressedImage.FromString(data)
    return CompressedImage(read.frame_id, read.format, read.data)


def _stamp(t_ns: int) -> Timestamp:
    seconds, nanos = divmod(t_ns, 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanos)


def _descriptor_set(root: Any) -> bytes:
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


def _schema(message: Any, encode: Callable[[Any, int], bytes], decode: Callable[[bytes], Any]) -> FoxgloveSchema:
    return FoxgloveSchema(message.DESCRIPTOR.full_name, _descriptor_set(message.DESCRIPTOR.file), encode, decode)


FOXGLOVE: dict[type, FoxgloveSchema] = {
    FrameTransform: _schema(FrameTransform_pb2.FrameTransform, _frame_to_bytes, _frame_from_bytes),
    JointStates: _schema(JointStates_pb2.JointStates, _joints_to_bytes, _joints_from_bytes),
    CompressedImage: _schema(CompressedImage_pb2.CompressedImage, _image_to_bytes, _image_from_bytes),
}
