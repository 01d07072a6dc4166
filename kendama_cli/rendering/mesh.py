"""Triangle meshes that rays hit through Embree, each in a frame of its own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import MissingPartError
from kendama_cli.schema.arrays import Array

try:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene
except ImportError:  # it has no wheel for Linux on aarch64; nothing stands in for it: a mesh is refused
    TriangleMesh = EmbreeScene = None

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class LinkMesh:
    """The surface of one link of a robot, in the link's frame.

    ``vertices_m`` (n, 3), ``triangles`` (m, 3) indices into them; their orientation does not matter. ``rgb`` is the
    reflectance, linear red, green, blue.
    """

    vertices_m: Array
    triangles: NDArray[np.int64]
    rgb: Triple

    def __post_init__(self) -> None:
        vertices, triangles = np.asarray(self.vertices_m), np.asarray(self.triangles)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise ValueError(f"a mesh needs finite vertices (n, 3), not {vertices.shape}")
        if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles):
            raise ValueError(f"a mesh needs triangles (m, 3) with m > 0, not {triangles.shape}")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise ValueError(f"a mesh of {len(vertices)} vertices has triangles that name vertex {triangles.max()}")


class Surface:
    """A mesh with its tree of boxes, built once; rays come in the mesh's own frame.

    Embree, in single precision, only says which triangle a ray meets; ``anchors`` and ``normals`` (m, 3) of the
    triangles then give the distance in double precision. Raises MissingPartError where Embree is not installed.
    """

    def __init__(self, mesh: LinkMesh, *, convex: bool = False) -> None:
        if EmbreeScene is None:
            raise MissingPartError(
                "embreex",
                "a camera was asked for the image of an arm or another mesh, which needs embreex (pip install embreex; "
                "it has no wheel for Linux on aarch64); ball, cup, rope and background are drawn without it",
            )
        vertices, triangles = np.asarray(mesh.vertices_m, dtype=np.float64), np.asarray(mesh.triangles)
        corners = vertices[triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        self.anchors = np.ascontiguousarray(corners[:, 0])
        self.normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
        self.low, self.high = vertices.min(axis=0), vertices.max(axis=0)
        self.box = np.array(np.meshgrid(*zip(self.low, self.high, strict=True))).reshape(3, 8)
        self.rgb, self.convex = mesh.rgb, convex
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, vertices.astype(np.float32), triangles.astype(np.int32))

    def first(self, origins: NDArray[np.float32], directions: NDArray[np.float32]) -> NDArray[np.int32]:
        """Return the triangle (n,) that each ray meets first; -1 where it meets none."""
        return np.asarray(self._scene.run(origins, directions, query="INTERSECT"))

    def blocked(self, origins: NDArray[np.float32], directions: NDArray[np.float32]) -> NDArray[np.int32]:
        """Return what (n,) blocks the segment from each origin to origin + direction: -1 where it is free."""
        reach = np.ones(len(origins), dtype=np.float32)
        return np.asarray(self._scene.run(origins, directions, dists=reach, query="OCCLUDED"))


@cache
def unit_cylinder(sides: int = 48) -> tuple[Array, NDArray[np.int64]]:
    """Return the vertices and triangles of an open cylinder of radius 1 about z, from z = 0 to 1."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)])
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    triangles = np.concatenate([np.column_stack([i, j, i + sides]), np.column_stack([j, j + sides, i + sides])])
    return np.concatenate([ring, ring + np.array([0.0, 0.0, 1.0])]), triangles


@cache
def unit_sphere(rings: int = 24) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices and triangles of a unit sphere about the origin, of ``rings`` bands of 2 ``rings`` quads."""
    sides = 2 * rings
    polar, around = np.pi * np.arange(rings + 1) / rings, 2 * np.pi * np.arange(sides) / sides
    theta, phi = np.repeat(polar, sides), np.tile(around, rings + 1)
    vertices = np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    band, side = np.repeat(np.arange(rings), sides), np.tile(np.arange(sides), rings)
    a, b = band * sides + side, band * sides + (side + 1) % sides
    triangles = np.concatenate([np.column_stack([a, a + sides, b]), np.column_stack([b, a + sides, b + sides])])
    return vertices, triangles
