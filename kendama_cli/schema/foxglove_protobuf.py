"""Foxglove's protobuf schemas behind the light dataclasses of ``schema/foxglove.py``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from foxglove_schemas_protobuf import (
    CompressedImage_pb2,
    FrameTransform_pb2,
    FrameTransforms_pb2,
    JointStates_pb2,
    SceneUpdate_pb2,
)
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.timestamp_pb2 import Timestamp

from kendama_cli.schema.foxglove import (
    CompressedImage,
    FrameTransform,
    FrameTransforms,
    JointStates,
    SceneUpdate,
    Solid,
    SolidKind,
)

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


def _frame(
    parent: str, child: str, position_m: Collection[float], rotation_wxyz: Collection[float], t_ns: int
) -> FrameTransform_pb2.FrameTransform:
    x, y, z = map(float, position_m)  # protobuf itself would take None for a zero
    qw, qx, qy, qz = map(float, rotation_wxyz)
    return FrameTransform_pb2.FrameTransform(
        timestamp=_stamp(t_ns),
        parent_frame_id=parent,
        child_frame_id=child,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
    )


def _frame_to_bytes(message: FrameTransform, t_ns: int) -> bytes:
    frame = _frame(message.parent, message.child, message.position_m, message.rotation_wxyz, t_ns)
    return frame.SerializeToString(deterministic=True)


def _frame_from_bytes(data: bytes) -> FrameTransform:
    read = FrameTransform_pb2.FrameTransform.FromString(data)
    at, rotation = read.translation, read.rotation
    return FrameTransform(
        read.parent_frame_id, read.child_frame_id, (at.x, at.y, at.z), (rotation.w, rotation.x, rotation.y, rotation.z)
    )


def _frames_to_bytes(message: FrameTransforms, t_ns: int) -> bytes:
    rows = zip(message.children, message.positions_m, message.rotations_wxyz, strict=True)
    transforms = [_frame(message.parent, child, at, rotation, t_ns) for child, at, rotation in rows]
    return FrameTransforms_pb2.FrameTransforms(transforms=transforms).SerializeToString(deterministic=True)


def _frames_from_bytes(data: bytes) -> FrameTransforms:
    read = FrameTransforms_pb2.FrameTransforms.FromString(data).transforms
    return FrameTransforms(
        read[0].parent_frame_id if read else "",
        tuple(one.child_frame_id for one in read),
        tuple((at.x, at.y, at.z) for at in (one.translation for one in read)),
        tuple((rotation.w, rotation.x, rotation.y, rotation.z) for rotation in (one.rotation for one in read)),
    )


def _scene_to_bytes(message: SceneUpdate, t_ns: int) -> bytes:
    made = SceneUpdate_pb2.SceneUpdate()
    for number, solid in enumerate(message.solids):
        entity = made.entities.add(id=f"{number} {solid.name}", frame_id=solid.frame, frame_locked=True)
        entity.timestamp.CopyFrom(_stamp(t_ns))
        entity.metadata.add(key="name", value=solid.name)
        scene_into(entity, solid)
    return made.SerializeToString(deterministic=True)


def _scene_from_bytes(data: bytes) -> SceneUpdate:
    entities = SceneUpdate_pb2.SceneUpdate.FromString(data).entities
    return SceneUpdate(tuple(solid for entity in entities for solid in scene_from(entity)))


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
    FrameTransforms: _schema(FrameTransforms_pb2.FrameTransforms, _frames_to_bytes, _frames_from_bytes),
    JointStates: _schema(JointStates_pb2.JointStates, _joints_to_bytes, _joints_from_bytes),
    CompressedImage: _schema(CompressedImage_pb2.CompressedImage, _image_to_bytes, _image_from_bytes),
    SceneUpdate: _schema(SceneUpdate_pb2.SceneUpdate, _scene_to_bytes, _scene_from_bytes),
}


_FIELDS: tuple[tuple[SolidKind, str], ...] = (("box", "cubes"), ("cylinder", "cylinders"), ("sphere", "spheres"))
"""Kind of solid -> the field of foxglove.SceneEntity that holds it; meshes are triangles."""


def scene_into(entity: SceneEntity, solid: Solid) -> None:
    """Add ``solid`` to ``entity``."""
    qw, qx, qy, qz = map(float, solid.rotation_wxyz)
    pose = Pose(position=_vector(solid.position_m), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))
    r, g, b = map(float, solid.rgb)
    color = Color(r=r, g=g, b=b, a=1.0)
    if solid.kind == "mesh":
        mesh = entity.triangles.add(pose=pose, color=color)
        for x, y, z in solid.vertices_m:
            mesh.points.add(x=float(x), y=float(y), z=float(z))
        mesh.indices.extend(int(corner) for triangle in solid.triangles for corner in triangle)
        return
    size = _vector(solid.size_m)
    for kind, field in _FIELDS:
        if kind == solid.kind:
            made = getattr(entity, field).add(pose=pose, size=size, color=color)
            if kind == "cylinder":
                made.bottom_scale, made.top_scale = 1.0, float(solid.top_scale)


def scene_from(entity: SceneEntity) -> Iterator[Solid]:
    """Yield the solids of ``entity``."""
    name = next((pair.value for pair in entity.metadata if pair.key == "name"), entity.id)
    for kind, field in _FIELDS:
        for one in getattr(entity, field):
            size = (one.size.x, one.size.y, one.size.z)
            top = float(one.top_scale) if kind == "cylinder" else 1.0
            yield Solid(entity.frame_id, name, kind, **_look(one), size_m=size, top_scale=top)
    for one in entity.triangles:
        corners = list(one.indices) or list(range(len(one.points)))
        yield Solid(
            entity.frame_id,
            name,
            "mesh",
            **_look(one),
            vertices_m=tuple((point.x, point.y, point.z) for point in one.points),
            triangles=tuple(zip(corners[::3], corners[1::3], corners[2::3], strict=True)),
        )


def _look(primitive: Any) -> dict[str, Any]:
    at, rotation, color = primitive.pose.position, primitive.pose.orientation, primitive.color
    return {
        "rgb": (color.r, color.g, color.b),
        "position_m": (at.x, at.y, at.z),
        "rotation_wxyz": (rotation.w, rotation.x, rotation.y, rotation.z),
    }


def _vector(values: Collection[float]) -> Vector3:
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)
