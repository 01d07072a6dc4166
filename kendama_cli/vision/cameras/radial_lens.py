"""The lens of most cameras: a pinhole with OpenCV's radial and tangential distortion."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.schema.arrays import Array

FITTED = 8
"""Numbers of a lens that a calibration finds: fx, fy, cx, cy and the first four of its distortion."""
AHEAD_M = 1e-6
"""Nearer to the image plane, or behind it, a point has no pixel."""


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
class RadialLens:
    """With (x, y) = p_xy / p_z distorted by OpenCV's (k1, k2, p1, p2, k3), the pixel is (fx x + cx, fy y + cy)."""

    fx: float
    fy: float
    cx: float
    cy: float
    k1: float
    k2: float
    p1: float
    p2: float
    k3: float = 0.0

    @cached_property
    def matrix(self) -> Array:
        """OpenCV's camera matrix (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @cached_property
    def distortion(self) -> Array:
        """(k1, k2, p1, p2, k3)."""
        return np.array(astuple(self)[4:])

    @cached_property
    def focal_px(self) -> Array:
        """(fx, fy)."""
        return np.array([self.fx, self.fy])

    @cached_property
    def center_px(self) -> Array:
        """(cx, cy)."""
        return np.array([self.cx, self.cy])

    def project(self, points_m: Array) -> Array:
        """Pixels (n, 2); nan for a point that is not in front of the camera."""
        ahead = points_m[:, 2] > AHEAD_M
        pixels = np.full((len(points_m), 2), np.nan)
        if ahead.any():
            found, _ = cv2.projectPoints(points_m[ahead], np.zeros(3), np.zeros(3), self.matrix, self.distortion)
            pixels[ahead] = found.reshape(-1, 2)
        return pixels

    def undistort(self, pixels: Array) -> Array:
        """Normalised image coordinates (x, y) (n, 2)."""
        if not self.distortion.any():
            return np.asarray((pixels - self.center_px) / self.focal_px)
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-12)
        # OpenCV 4 takes the criterion in a function of its own, OpenCV 5 in the only one that it has
        undistorted = getattr(cv2, "undistortPointsIter", None) or cv2.undistortPoints
        found = undistorted(pixels.reshape(-1, 1, 2), self.matrix, self.distortion, R=None, P=None, criteria=stop)
        return np.asarray(found, dtype=np.float64).reshape(-1, 2)

    def straight(self, u: float, v: float) -> Straight:
        """Newton's method on OpenCV's model; where that does not converge, OpenCV's own fixed point."""
        fx, fy = self.fx, self.fy
        desired_x, desired_y = (u - self.cx) / fx, (v - self.cy) / fy
        x, y = desired_x, desired_y
        for _ in range(10):
            at = self._distorted(x, y)
            off_x, off_y = desired_x - at.u, desired_y - at.v
            if abs(off_x) + abs(off_y) < 1e-10:
                return Straight(x, y, fx * at.x_x, fx * at.x_y, fy * at.x_y, fy * at.y_y)
            spread = at.x_x * at.y_y - at.x_y * at.x_y
            if spread <= 0.01:  # the model folds over here: Newton's step would leave the image
                break
            x += (at.y_y * off_x - at.x_y * off_y) / spread
            y += (at.x_x * off_y - at.x_y * off_x) / spread
        x, y = (float(value) for value in self.undistort(np.array([[u, v]]))[0])
        at = self._distorted(x, y)
        return Straight(x, y, fx * at.x_x, fx * at.x_y, fy * at.x_y, fy * at.y_y)

    def _distorted(self, x: float, y: float) -> _Distorted:
        k1, k2, p1, p2, k3 = self.k1, self.k2, self.p1, self.p2, self.k3
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

    @property
    def coarsest_px(self) -> float:
        """The focal length, as if there were no distortion."""
        return min(self.fx, self.fy)

    def posed(self, points_m: Array, rotation: ArrayLike, shift: ArrayLike) -> tuple[Array, Array]:
        """Project by OpenCV; points behind the camera are mirrored."""
        made = cv2.projectPoints(points_m, np.asarray(rotation), np.asarray(shift), self.matrix, self.distortion)
        pixels, slopes = (np.asarray(one, dtype=np.float64) for one in made)
        return pixels.reshape(-1, 2), slopes[:, : 6 + FITTED]

    def sphere_centre(self, disc_px: Array, radius_px: float) -> Array:
        """Return the centre of a sphere by its disc.

        A sphere seen under the half angle alpha at the angle theta off the axis has its disc's centre at
        tan(theta) cos^2(theta) / (cos^2(theta) - sin^2(alpha)); for a small ball alpha / cos(theta) is radius / focal.
        """
        shrink = 1 - (radius_px / float(self.focal_px.mean())) ** 2
        return np.asarray(self.center_px + shrink * (disc_px - self.center_px))

    def size_px(self, position_m: Array, radius_m: float) -> float:
        """Return the radius as at the image's centre."""
        return float(self.focal_px.mean()) * radius_m / float(position_m[2])
