"""The solids of a scene as primitives of a foxglove.SceneEntity, and back."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from kendama_cli.schema.foxglove import Solid, SolidKind

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
    """The solids of ``entity``."""
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
    at, turn, color = primitive.pose.position, primitive.pose.orientation, primitive.color
    return {
        "rgb": (color.r, color.g, color.b),
        "position_m": (at.x, at.y, at.z),
        "rotation_wxyz": (turn.w, turn.x, turn.y, turn.z),
    }


def _vector(values: Collection[float]) -> Vector3:
    x, y, z = map(float, values)
    return Vector3(x=x, y=y, z=z)
