"""The calibrated camera: its lens, and its pose in the world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.schema.arrays import Array, set_arrays
from kendama_cli.settings.camera import LensKind
from kendama_cli.vision.cameras.radial_lens import RadialLens, Straight


@dataclass(frozen=True)
class CameraModel:
    """A camera whose axes are x right, y down, z forward; pixel centres lie at whole numbers.

    A world point p becomes c = R (p - o), of which the lens makes a pixel (``kendama_cli.vision.cameras.radial_lens``).
    """

    name: str
    width_px: int
    height_px: int
    focal_px: Array
    """(fx, fy)"""
    center_px: Array
    """(cx, cy)"""
    distortion: Array
    """(k1, k2, p1, p2, k3)"""
    world_to_camera: Array
    """R (3, 3)"""
    position_in_world_m: Array
    """o (3,)"""
    lens: LensKind = "radial"
    readout_s: float = 0.0
    """From the first row's exposure to the last's; 0 of a global shutter"""
    link: str | None = None
    """The arm's link that carries the camera: what is said of the world is then of this link (see ``carried``)"""

    def __post_init__(self) -> None:
        set_arrays(self, focal_px=(2,), center_px=(2,), distortion=(5,))
        set_arrays(self, world_to_camera=(3, 3), position_in_world_m=(3,))
        if (
            not np.allclose(self.world_to_camera @ self.world_to_camera.T, np.eye(3), atol=1e-9)
            or np.linalg.det(self.world_to_camera) < 0
        ):
            raise ValueError(f"camera '{self.name}': world_to_camera is not a rotation")
        try:
            _ = self.optics
        except ValueError as error:
            raise ValueError(f"camera '{self.name}': {error}") from None

    @cached_property
    def optics(self) -> RadialLens:
        """The lens, which knows all about distortion."""
        return RadialLens(*(float(value) for value in (*self.focal_px, *self.center_px, *self.distortion)))

    @property
    def row_s(self) -> float:
        """Return the delay of a row's exposure after the row above it [s]."""
        return self.readout_s / self.height_px

    def exposed_s(self, frame_s: ArrayLike, pixels: ArrayLike) -> Array:
        """Return the exposure times of ``pixels`` (..., 2) in frames of times ``frame_s`` (...), which are the
        centre row's.

        Row v of h rows is exposed at frame_s + (v - (h - 1) / 2) row_s.
        """
        rows = np.asarray(pixels, dtype=np.float64)[..., 1] - (self.height_px - 1) / 2
        return np.asarray(frame_s, dtype=np.float64) + rows * self.row_s

    def carried(self, rotation: Array, position_m: Array) -> CameraModel:
        """Return the camera in the world in which its link has the axes ``rotation`` (3, 3) and ``position_m`` (3,)."""
        return replace(
            self,
            link=None,
            world_to_camera=self.world_to_camera @ rotation.T,
            position_in_world_m=position_m + rotation @ self.position_in_world_m,
        )

    def depth_m(self, points_m: ArrayLike) -> Array:
        """Distance (n,) of ``points_m`` (n, 3) in front of the image plane; negative behind it."""
        return np.asarray((np.asarray(points_m) - self.position_in_world_m) @ self.world_to_camera[2])

    def in_camera(self, points_m: ArrayLike) -> Array:
        """World ``points_m`` (n, 3) in the camera's axes (n, 3)."""
        points = np.atleast_2d(np.asarray(points_m, dtype=np.float64))
        return np.asarray((points - self.position_in_world_m) @ self.world_to_camera.T)

    def project(self, points_m: ArrayLike) -> Array:
        """Pixels (n, 2) of world ``points_m`` (n, 3); nan for a point behind the camera."""
        return self.optics.project(self.in_camera(points_m))

    def undistort(self, pixels: ArrayLike) -> Array:
        """Normalised image coordinates (x, y) (n, 2) of ``pixels`` (n, 2), distortion taken out."""
        return self.optics.undistort(np.atleast_2d(np.asarray(pixels, dtype=np.float64)))

    def straight(self, u: float, v: float) -> Straight:
        """Undistort one pixel; return it with the slope of the distortion there."""
        return self.optics.straight(u, v)

    def rays(self, pixels: ArrayLike) -> Array:
        """Return directions (n, 3) in the world through ``pixels`` (n, 2), of length 1 along the optical axis."""
        flat = self.undistort(pixels)
        return np.asarray(np.column_stack([flat, np.ones(len(flat))]) @ self.world_to_camera)

    def size_px(self, position_m: ArrayLike, radius_m: float) -> float:
        """Return the mean radius [px] of the disc of a sphere of ``radius_m`` at the world's ``position_m`` (3,)."""
        return self.optics.size_px(self.in_camera(position_m)[0], radius_m)


PlaceCamera = Callable[[CameraModel, float], CameraModel]
"""Function that returns a camera on a link in the world, as the arm carries it at a time [s]."""


def looking_at(position_m: ArrayLike, target_m: ArrayLike) -> Array:
    """World-to-camera rotation (3, 3) of a level camera at ``position_m`` that looks at ``target_m``.

    Raises ValueError where the view is straight up or down, for then "level" says nothing.
    """
    forward = np.asarray(target_m, dtype=np.float64) - np.asarray(position_m, dtype=np.float64)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-6 * max(float(np.linalg.norm(forward)), 1e-12):
        raise ValueError("a camera cannot look straight up or down, nor at its own position")
    forward, right = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
    return np.array([right, np.cross(forward, right), forward])
