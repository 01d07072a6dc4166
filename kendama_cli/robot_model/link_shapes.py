"""The collision shapes of a URDF's links, simplified to be looked at."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from kendama_cli.motion.rotation import quaternion_of
from kendama_cli.robot_model.urdf_tree import read_tree
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import Solid

MOST_TRIANGLES = 1200
"""Of one link; a finer mesh is thinned until it has no more."""
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


def thinned(vertices_m: Array, triangles: NDArray[np.int64], most: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the mesh with at most ``most`` triangles: vertices in the same cell of an ever coarser grid become
    their mean.
    """
    low, extent = vertices_m.min(axis=0), float(np.ptp(vertices_m, axis=0).max())
    cells, points, corners = 512.0, vertices_m, triangles
    while len(corners) > most:
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
