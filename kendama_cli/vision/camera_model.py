"""The calibrated camera: pinhole, OpenCV's lens distortion, pose in the world."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.schema.arrays import Array, array


class Straight(NamedTuple):
    """An undistorted point (x, y) and the four entries of d(pixel) / d(x, y) there."""

    x: float
    y: float
    u_x: float
    u_y: float
    v_x: float
    v_y: float


class _Distorted(NamedTuple):
    """OpenCV's distortion of one point (u, v) and its derivative, which is symmetric."""

    u: float
    v: float
    x_x: float
    x_y: float
    y_y: float


@dataclass(frozen=True)
class CameraModel:
    """A camera whose axes are x right, y down, z forward; pixel centres lie at whole numbers.

    A world point p becomes c = R (p - o); with (x, y) = c_xy / c_z distorted by OpenCV's
    (k1, k2, p1, p2, k3), the pixel is (fx x + cx, fy y + cy).
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

    def __post_init__(self) -> None:
        for name, shape in (
            ("focal_px", (2,)),
            ("center_px", (2,)),
            ("distortion", (5,)),
            ("world_to_camera", (3, 3)),
            ("position_in_world_m", (3,)),
        ):
            object.__setattr__(self, name, array(name, getattr(self, name), shape))
        if (
            not np.allclose(self.world_to_camera @ self.world_to_camera.T, np.eye(3), atol=1e-9)
            or np.linalg.det(self.world_to_camera) < 0
        ):
            raise ValueError(f"camera '{self.name}': world_to_camera is not a rotation")

    @property
    def matrix(self) -> Array:
        """OpenCV's camera matrix (3, 3)."""
        (fx, fy), (cx, cy) = self.focal_px, self.center_px
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def depth_m(self, points_m: ArrayLike) -> Array:
        """Distance (n,) of ``points_m`` (n, 3) in front of the image plane; negative behind it."""
        return np.asarray((np.asarray(points_m) - self.position_in_world_m) @ self.world_to_camera[2])

    def project(self, points_m: ArrayLike) -> Array:
        """Pixels (n, 2) of world ``points_m`` (n, 3); nan for a point that is not in front of the camera."""
        points = (
            np.atleast_2d(np.asarray(points_m, dtype=np.float64)) - self.position_in_world_m
        ) @ self.world_to_camera.T
        ahead = points[:, 2] > 1e-6
        pixels = np.full((len(points), 2), np.nan)
        if ahead.any():
            found, _ = cv2.projectPoints(points[ahead], np.zeros(3), np.zeros(3), self.matrix, self.distortion)
            pixels[ahead] = found.reshape(-1, 2)
        return pixels

    def undistort(self, pixels: ArrayLike) -> Array:
        """Normalised image coordinates (x, y) (n, 2) of ``pixels`` (n, 2), distortion taken out."""
        pixels = np.atleast_2d(np.asarray(pixels, dtype=np.float64))
        if not self.distortion.any():
            return np.asarray((pixels - self.center_px) / self.focal_px)
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-12)
        found = cv2.undistortPoints(pixels.reshape(-1, 1, 2), self.matrix, self.distortion, criteria=stop)
        return np.asarray(found, dtype=np.float64).reshape(-1, 2)

    @cached_property
    def lens(self) -> tuple[float, ...]:
        """fx, fy, cx, cy, k1, k2, p1, p2, k3 as plain numbers, for what is done pixel by pixel."""
        return tuple(float(value) for value in (*self.focal_px, *self.center_px, *self.distortion))

    def straight(self, u: float, v: float) -> Straight:
        """One pixel with the distortion taken out, and the slope of the distortion there.

        Newton's method on OpenCV's model; where that does not converge, OpenCV's own fixed point.
        """
        fx, fy, cx, cy = self.lens[:4]
        wanted_x, wanted_y = (u - cx) / fx, (v - cy) / fy
        x, y = wanted_x, wanted_y
        for _ in range(10):
            at = self._distorted(x, y)
            off_x, off_y = wanted_x - at.u, wanted_y - at.v
            if abs(off_x) + abs(off_y) < 1e-10:
                return Straight(x, y, fx * at.x_x, fx * at.x_y, fy * at.x_y, fy * at.y_y)
            spread = at.x_x * at.y_y - at.x_y * at.x_y
            if spread <= 0.01:  # the model folds over here: Newton's step would leave the image
                break
            x += (at.y_y * off_x - at.x_y * off_y) / spread
            y += (at.x_x * off_y - at.x_y * off_x) / spread
        x, y = (float(value) for value in self.undistort((u, v))[0])
        at = self._distorted(x, y)
        return Straight(x, y, fx * at.x_x, fx * at.x_y, fy * at.x_y, fy * at.y_y)

    def _distorted(self, x: float, y: float) -> _Distorted:
        k1, k2, p1, p2, k3 = self.lens[4:]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = k1 + r2 * (2 * k2 + 3 * k3 * r2)  # d(radial) / d(r2)
        return _Distorted(
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x,
            2 * x * y * slope + 2 * p1 * x + 2 * p2 * y,
            radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x,
        )

    def rays(self, pixels: ArrayLike) -> Array:
        """Directions (n, 3) in the world through ``pixels`` (n, 2), of length 1 along the optical axis."""
        flat = self.undistort(pixels)
        return np.asarray(np.column_stack([flat, np.ones(len(flat))]) @ self.world_to_camera)


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
