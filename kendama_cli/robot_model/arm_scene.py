"""Appearance of an arm, its cup and the ball, and the poses of the arm's links: for logs, replays and videos."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from kendama_cli.motion.rotation import quaternion_of
from kendama_cli.robot_model.colours import BALL_RGB, CUP_RGB, JOINT_RGB, SHELL_RGB, STAND_RGB, Rgb
from kendama_cli.robot_model.cup import cup_frame
from kendama_cli.robot_model.description import dart_name
from kendama_cli.robot_model.model import HANDLE_RADIUS_M, RobotModel
from kendama_cli.robot_model.urdf_tree import read_tree
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransforms, SceneUpdate, Solid
from kendama_cli.settings.game import CupSettings, GameSettings, HandleTie

MOST_TRIANGLES = 1200
"""Maximum number of triangles of one link; a finer mesh is thinned to it."""
_COARSER = 1.25
_STL_HEADER, _STL_TRIANGLE = 84, 50

Pose = tuple[Array, Array]
"""A rotation (3, 3) and a place (3,) [m]."""


def link_shapes(path: str, holders: Mapping[str, tuple[str, Any]], rgb: tuple[float, float, float]) -> list[Solid]:
    """Return the boxes, cylinders, spheres and STL meshes of the URDF at ``path``, in ``rgb``.

    ``holders`` names for every link the frame that it is drawn in and its pose (an Isometry3) there. Empty where the
    URDF has no shapes, or one that cannot be read (another format, another place): part of an arm misleads.
    """
    solids = []
    for name, link in read_tree(path).links.items():
        if name not in holders:  # before the base link
            continue
        frame, place = holders[name]
        for collision in link.findall("collision"):
            pose = np.array(place.rotation()), np.array(place.translation())
            try:
                solid = _solid(path, frame, collision, _joined(pose, _origin(collision)), rgb)
            except ValueError:  # not numbers: the dynamics do not read them, so nobody has refused them
                return []
            if solid is None:
                return []
            solids.append(solid)
    return solids


def thinned(vertices_m: Array, triangles: NDArray[np.int64], maximum: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the mesh with at most ``maximum`` triangles: vertices in the same cell of an ever coarser grid become
    their mean.
    """
    low, extent = vertices_m.min(axis=0), float(np.ptp(vertices_m, axis=0).max())
    cells, points, corners = 512.0, vertices_m, triangles
    while len(corners) > maximum:
        cell = np.floor((vertices_m - low) / (extent / cells)).astype(np.int64)
        _, label = np.unique(cell, axis=0, return_inverse=True)
        label = label.reshape(-1)
        count = np.bincount(label)
        points = np.column_stack([np.bincount(label, vertices_m[:, axis]) / count for axis in range(3)])
        corners = label[triangles]
        whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
        corners = np.unique(corners[whole], axis=0)
        cells /= _COARSER
    return points, corners


def read_stl(path: Path) -> tuple[Array, NDArray[np.int64]] | None:
    """Return the vertices (n, 3), joined where they are equal, and triangles (m, 3) of a binary STL file; None for
    any other.
    """
    try:
        if not path.is_file():  # a URDF may name a device, whose content has no end
            return None
        with path.open("rb") as stream:
            head = stream.read(_STL_HEADER)
            count = struct.unpack_from("<I", head, _STL_HEADER - 4)[0] if len(head) == _STL_HEADER else 0
            if not count or path.stat().st_size != _STL_HEADER + _STL_TRIANGLE * count:
                return None
            data = stream.read()
    except (OSError, ValueError):
        return None
    rows = np.frombuffer(data, np.uint8).reshape(count, _STL_TRIANGLE)
    corners = np.ascontiguousarray(rows[:, 12:48]).view("<f4").reshape(-1, 3).astype(np.float64)
    if not np.isfinite(corners).all():
        return None
    points, label = np.unique(corners, axis=0, return_inverse=True)
    return points, label.reshape(-1, 3)


def _solid(path: str, frame: str, collision: ET.Element, place: Pose, rgb: tuple[float, float, float]) -> Solid | None:
    at: dict[str, Any] = {"position_m": place[1], "rotation_wxyz": quaternion_of(place[0])}
    if (box := collision.find("geometry/box")) is not None:
        return Solid(frame, "link", "box", rgb, _numbers(box, "size"), **at)
    if (rod := collision.find("geometry/cylinder")) is not None:
        across, along = 2 * float(rod.get("radius", 0)), float(rod.get("length", 0))
        return Solid(frame, "link", "cylinder", rgb, (across, across, along), **at)
    if (ball := collision.find("geometry/sphere")) is not None:
        return Solid(frame, "link", "sphere", rgb, (2 * float(ball.get("radius", 0)),) * 3, **at)
    mesh = collision.find("geometry/mesh")
    read = None if mesh is None else read_stl(_mesh_file(path, mesh.get("filename", "")))
    if mesh is None or read is None:
        return None
    scale = np.array(_numbers(mesh, "scale", "1 1 1"))
    vertices, triangles = thinned(read[0] * scale, read[1], MOST_TRIANGLES)
    return Solid(frame, "link", "mesh", rgb, **at, vertices_m=vertices, triangles=triangles)


def _mesh_file(path: str, name: str) -> Path:
    """Return the file of a mesh, which ``package://`` names relative to a folder of that name above the URDF."""
    if name.startswith("package://"):
        package, _, inside = name.removeprefix("package://").partition("/")
        above = [folder for folder in Path(path).resolve().parents if folder.name == package]
        return above[0] / inside if above else Path(name)
    return Path(path).parent / name.removeprefix("file://")


def _origin(collision: ET.Element) -> Pose:
    origin = collision.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    turned = Rotation.from_euler("xyz", _numbers(origin, "rpy", "0 0 0")).as_matrix()
    return turned, np.array(_numbers(origin, "xyz", "0 0 0"))


def _joined(outer: Pose, inner: Pose) -> Pose:
    return outer[0] @ inner[0], outer[0] @ inner[1] + outer[1]


def _numbers(element: ET.Element, name: str, default: str = "") -> tuple[float, ...]:
    return tuple(float(word) for word in (element.get(name) or default).split())


WORLD = "world"
SHORTEST_M = 1e-3
"""Joints nearer to each other than this have nothing between them that could be drawn."""
_SIDES = 40


class ArmScene:
    """The arm of ``model`` in frames of its own: ``shapes`` once, ``frames`` for every posture."""

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self._body = model.new_body()
        self._links = [self._body.skeleton.getBodyNode(0), *_moving_links(self._body)]
        self._names = [link.getName() for link in self._links]

    def shapes(self, game: GameSettings) -> SceneUpdate:
        """Return the links as their URDF's collision shapes, or as capsules from joint to joint if it has none.

        Beside them the pedestal, the handle, and the cup and ball of ``game`` in the frames ``cup`` and ``ball``.
        """
        model, body = self._model, self._body
        body.skeleton.setPositions(model.home_rad)
        holders = {link.getName(): self._holder(link) for link in body.skeleton.getBodyNodes()}
        solids = link_shapes(model.settings.path, holders, SHELL_RGB) or self._capsules()
        radius_m = 2 * game.ball.radius_m
        ball = Solid("ball", "ball", "sphere", BALL_RGB, size_m=(radius_m, radius_m, radius_m))
        return SceneUpdate((*self._pedestal(), *solids, *self._handle(game.cup), cup_solid(game.cup), ball))

    def frames(self, position_rad: Array) -> FrameTransforms:
        """Return the poses of the links in the world for the joint angles (n,)."""
        self._body.skeleton.setPositions(position_rad)
        poses = [link.getWorldTransform() for link in self._links]
        return FrameTransforms(
            WORLD,
            self._names,
            [np.array(pose.translation()) for pose in poses],
            [quaternion_of(np.array(pose.rotation())) for pose in poses],
        )

    def holder(self, link: str) -> tuple[str, Pose]:
        """Return the drawn frame that the URDF's ``link`` is fixed to, and the link's pose in it."""
        frame, pose = self._holder(self._body.skeleton.getBodyNode(dart_name(link)))
        return frame, (np.array(pose.rotation()), np.array(pose.translation()))

    def _holder(self, link: Any) -> tuple[str, Any]:
        """Return the drawn frame that ``link`` is fixed to, and the link's pose in it."""
        holder = link
        while holder.getName() not in self._names:
            holder = holder.getParentBodyNode()
        return holder.getName(), holder.getWorldTransform().inverse().multiply(link.getWorldTransform())

    def _capsules(self) -> list[Solid]:
        """Return a tube from each joint's origin to the next one's, rounded at its ends, and a hub about each axis."""
        model = self._model
        positions = model.joint_positions_m(model.home_rad)
        solids = []
        for i, (radius, (start, end)) in enumerate(zip(model.link_radius_m.tolist(), pairwise(positions), strict=True)):
            link, joint = self._links[i + 1], self._body.joints[i]
            solids += _tube(link, "link", (start, end), radius, SHELL_RGB)
            frame = link.getWorldTransform().multiply(joint.getTransformFromChildBodyNode())
            axis = np.array(frame.rotation()) @ np.array(joint.getAxis())
            half = axis * 1.12 * radius
            solids.append(_rod(link, "joint", (start - half, start + half), 0.86 * radius, JOINT_RGB))
        root = np.array(self._links[0].getWorldTransform().translation())
        solids += _tube(self._links[0], "base", (root, positions[0]), 1.1 * float(model.link_radius_m[0]), SHELL_RGB)
        return solids

    def _pedestal(self) -> list[Solid]:
        """Return the pedestal of the arm, from the floor at z = 0; empty if its base is on or below the floor."""
        root = np.array(self._links[0].getWorldTransform().translation())
        if root[2] < 0.02:
            return []
        radius = 1.15 * float(self._model.link_radius_m.max())
        foot = root * np.array([1.0, 1.0, 0.0])
        flange = foot + np.array([0.0, 0.0, 0.02])
        link = self._links[0]
        return [
            _rod(link, "pedestal", (foot, root), radius, STAND_RGB),
            _rod(link, "pedestal", (foot, flange), 1.8 * radius, STAND_RGB),
        ]

    def _handle(self, cup: CupSettings) -> list[Solid]:
        """Return the handle from the tip link to the cup's wall."""
        model, tip = self._model, self._body.tip
        start = np.array(tip.getWorldTransform().translation())
        path = model.tool_position_m(model.home_rad) - start
        length = float(np.linalg.norm(path))
        short = length - cup.outer_radius_m
        if short < SHORTEST_M:
            return []
        return _tube(self._links[-1], "handle", (start, start + path * (short / length)), HANDLE_RADIUS_M, JOINT_RGB)


def cup_solid(cup: CupSettings) -> Solid:
    """Return the cup as a lathed mesh in the frame ``cup``: its origin is the tie point, its z the cup's axis.

    The profile goes up the outer wall, over the rim and down the inner wall.
    """
    wall, low, high = cup.wall_m, cup.floor_m, cup.rim_m
    profile = [(0.0, low), (cup.outer_radius_m, low), (cup.outer_radius_m, high), (cup.radius_m, high)]
    profile += [(cup.radius_m, low + wall), (0.0, low + wall)]
    if isinstance(cup.tie, HandleTie):
        profile = [(0.0, 0.0), (cup.tie.radius_m, 0.0), (cup.tie.radius_m, low), *profile[1:]]
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    radius, height = np.array(profile).T
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    vertices = np.concatenate(
        [radius[:, None, None] * ring[None], np.broadcast_to(height[:, None, None], (len(profile), _SIDES, 1))], axis=2
    ).reshape(-1, 3)
    band, side = np.divmod(np.arange((len(profile) - 1) * _SIDES), _SIDES)
    a, b = band * _SIDES + side, band * _SIDES + (side + 1) % _SIDES
    triangles = np.concatenate([np.column_stack([a, b, a + _SIDES]), np.column_stack([b, b + _SIDES, a + _SIDES])])
    return Solid("cup", "cup", "mesh", CUP_RGB, vertices_m=vertices, triangles=triangles)


def _moving_links(body: Any) -> list[Any]:
    return [joint.getChildBodyNode() for joint in body.joints]


def _tube(link: Any, name: str, ends_m: tuple[Array, Array], radius_m: float, rgb: Rgb) -> list[Solid]:
    """Return a capsule between two points of the world, fixed to ``link`` at its present pose."""
    ends = [_ball(link, name, position, radius_m, rgb) for position in ends_m]
    if float(np.linalg.norm(ends_m[1] - ends_m[0])) < SHORTEST_M:
        return ends[:1]
    return [_rod(link, name, ends_m, radius_m, rgb), *ends]


def _rod(link: Any, name: str, ends_m: tuple[Array, Array], radius_m: float, rgb: Rgb) -> Solid:
    start_m, end_m = ends_m
    path = end_m - start_m
    rotation, position = _in_frame(link, cup_frame(tuple(path.tolist())), (start_m + end_m) / 2)
    size = (2 * radius_m, 2 * radius_m, float(np.linalg.norm(path)))
    return Solid(link.getName(), name, "cylinder", rgb, size, position, rotation)


def _ball(link: Any, name: str, place_m: Array, radius_m: float, rgb: Rgb) -> Solid:
    rotation, position = _in_frame(link, np.eye(3), place_m)
    return Solid(link.getName(), name, "sphere", rgb, (2 * radius_m,) * 3, position, rotation)


def _in_frame(link: Any, rotation: Array, place_m: Array) -> tuple[Array, Array]:
    """Return a pose of the world as quaternion and position in the frame of ``link``."""
    frame = link.getWorldTransform()
    turn, origin = np.array(frame.rotation()), np.array(frame.translation())
    return quaternion_of(turn.T @ rotation), turn.T @ (place_m - origin)
