"""The lens of wide views: the model of Kannala and Brandt, as OpenCV's ``fisheye`` has it.

Directions have (x, y) of length 1 along the axis everywhere else, and at 90 degrees there is none: the model is used up
to WIDEST_DEG off the axis, or to where it is no longer steep; what lies beyond is not seen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.kannala_brandt import NEAR_AXIS, SMALL_RAD, KannalaBrandt, angles
from kendama_cli.vision.lens_terms import FITTED, Pinhole, Straight


@dataclass(frozen=True)
class FisheyeLens:
    """A point at the angle theta off the axis has the pixel (fx g cos(phi) + cx, fy g sin(phi) + cy)."""

    fx: float
    fy: float
    cx: float
    cy: float
    k1: float
    k2: float
    k3: float
    k4: float
    unused: float = 0.0

    def __post_init__(self) -> None:
        if self.unused != 0.0:
            raise ValueError(f"a fisheye lens has k1, k2, k3, k4; the fifth number must be 0, not {self.unused:g}")

    @cached_property
    def _radial(self) -> KannalaBrandt:
        return KannalaBrandt(self.k1, self.k2, self.k3, self.k4)

    @property
    def widest_rad(self) -> float:
        """How far off the axis it sees."""
        return self._radial.widest_rad

    def _plane(self, pixels: Array) -> tuple[Array, Array]:
        """In focal lengths from the middle: place (n, 2) and distance (n,)."""
        place = (pixels - (self.cx, self.cy)) / (self.fx, self.fy)
        return place, np.hypot(place[:, 0], place[:, 1])

    def project(self, points_m: Array) -> Array:
        """Pixels (n, 2); nan for a point farther off the axis than ``widest_rad``."""
        theta, way = angles(points_m)
        seen = (theta <= self.widest_rad) & (points_m[:, 2] > 0)
        pixels = way * self._radial.bent(theta)[0][:, None] * (self.fx, self.fy) + (self.cx, self.cy)
        return np.asarray(np.where(seen[:, None], pixels, np.nan))

    def undistort(self, pixels: Array) -> Array:
        """Normalised image coordinates (x, y) (n, 2); nan beyond the edge of what it sees."""
        place, away = self._plane(pixels)
        theta = self._radial.off_axis(np.minimum(away, self._radial.edge))
        near = away <= NEAR_AXIS
        scale = np.where(near, 1.0, np.tan(theta) / np.where(near, 1.0, away))
        return np.asarray(np.where((away <= self._radial.edge)[:, None], place * scale[:, None], np.nan))

    def sees(self, pixels: Array) -> NDArray[np.bool_]:
        """Those within the circle that ``widest_rad`` makes."""
        return np.asarray(self._plane(pixels)[1] <= self._radial.edge)

    def straight(self, u: float, v: float) -> Straight:
        """All nan where nothing is seen; the slope is that of (x, y) g(theta) / tan(theta)."""
        x, y = (u - self.cx) / self.fx, (v - self.cy) / self.fy
        value = math.hypot(x, y)
        if not value <= self._radial.edge:
            return Straight(*(math.nan,) * 6)
        if value <= NEAR_AXIS:
            return Straight(x, y, self.fx, 0.0, 0.0, self.fy)
        theta = self._radial.off_axis_of(value)
        away, slope = math.tan(theta), self._radial.bent(theta)[1]
        x, y = x / value * away, y / value * away
        scale = value / away
        bend = (slope / (1 + away * away) - scale) / (away * away)
        return Straight(
            x, y, self.fx * (scale + x * x * bend), self.fx * x * y * bend,
            self.fy * x * y * bend, self.fy * (scale + y * y * bend),
        )  # fmt: skip

    def image_rays(self, pixels: Array) -> Array:
        """Unit directions (n, 3); beyond the edge that of the edge, for a picture must not tear there."""
        place, away = self._plane(pixels)
        theta = self._radial.off_axis(np.minimum(away, self._radial.edge))
        sideways = place / np.where(away > 0, away, 1.0)[:, None] * np.sin(theta)[:, None]
        return np.column_stack([sideways, np.cos(theta)])

    @cached_property
    def coarsest_px(self) -> float:
        """Pixels to a radian where they are fewest, towards the edge."""
        return min(self.fx, self.fy) * float(self._radial.bent(np.linspace(0.0, self.widest_rad, 90))[1].min())

    def posed(self, points_m: Array, turn: ArrayLike, shift: ArrayLike) -> tuple[Array, Array]:
        """The model without an edge, so that a fit that has far to go has a slope everywhere."""
        rotation, by_turn = cv2.Rodrigues(np.asarray(turn, dtype=np.float64))
        placed = points_m @ np.asarray(rotation).T + np.ravel(shift)
        by_place = self.place_slopes(placed)
        # (3, 9): the derivative of the rotation's entries, row by row
        turning = np.einsum("kij,nj->nik", np.asarray(by_turn).reshape(3, 3, 3), points_m)
        theta, way = angles(placed)
        value = self._radial.bent(theta)[0]
        pixels = np.array([self.fx, self.fy]) * way * value[:, None] + (self.cx, self.cy)
        slopes = np.zeros((len(points_m), 2, 6 + FITTED))
        slopes[:, :, :3], slopes[:, :, 3:6] = by_place @ turning, by_place
        for axis, focal in enumerate((self.fx, self.fy)):
            slopes[:, axis, 6 + axis] = way[:, axis] * value
            slopes[:, axis, 8 + axis] = 1.0
            slopes[:, axis, 10:] = (focal * way[:, axis])[:, None] * theta[:, None] ** [3, 5, 7, 9]
        return pixels, slopes.reshape(-1, 6 + FITTED)

    def place_slopes(self, points_m: Array) -> Array:
        """Those of the polynomial, in pixels."""
        return np.array([[self.fx], [self.fy]]) * self._radial.place_slopes(points_m)

    def pinhole(self, pixels: Array) -> Pinhole:
        """The pixels that a pinhole of the same focal length would show; nan for what it cannot."""
        matrix = np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])
        flat = self.undistort(np.asarray(pixels, dtype=np.float64))
        return Pinhole(flat * (self.fx, self.fy) + (self.cx, self.cy), matrix, np.zeros(5))

    def refined(self, points_m: Array, pixels: Array, turn: ArrayLike, shift: ArrayLike) -> tuple[Array, Array]:
        """Levenberg-Marquardt on the lens's own pixels, for noise is in these."""

        def off(pose: Array) -> Array:
            return (self.posed(points_m, pose[:3], pose[3:])[0] - pixels).ravel()

        def slopes(pose: Array) -> Array:
            return self.posed(points_m, pose[:3], pose[3:])[1][:, :6]

        found = least_squares(off, np.concatenate([np.ravel(turn), np.ravel(shift)]), jac=slopes, method="lm")
        return found.x[:3].reshape(3, 1), found.x[3:].reshape(3, 1)

    def sphere_centre(self, disc_px: Array, radius_px: float) -> Array:
        """To second order in the half angle under which it is seen."""
        disc_px = np.asarray(disc_px, dtype=np.float64)
        place, away = self._plane(disc_px[None])
        theta = self._radial.off_axis_of(min(float(away[0]), self._radial.edge))
        if theta < SMALL_RAD:
            return disc_px
        alpha = 2 * radius_px / (self.fx + self.fy) / float(self._radial.disc(np.array(theta)))
        outward = alpha**2 / 4 * self._radial.disc_shift(theta)
        return np.asarray(disc_px - outward * place[0] / away[0] * (self.fx, self.fy))

    def size_px(self, place_m: Array, radius_m: float) -> float:
        """By the half angle under which it is seen."""
        distance = float(np.linalg.norm(place_m))
        theta = math.atan2(math.hypot(place_m[0], place_m[1]), place_m[2])
        alpha = math.asin(min(radius_m / distance, 1.0))
        return (self.fx + self.fy) / 2 * alpha * float(self._radial.disc(np.array(theta)))

    def depth_m(self, rays: Array, radius_px: Array, radius_m: float) -> Array:
        """From the half angle: distance = radius / sin(alpha)."""
        long = np.linalg.norm(rays, axis=1)
        alpha = 2 * radius_px / (self.fx + self.fy) / self._radial.disc(np.arccos(1 / long))
        return np.asarray(radius_m / np.sin(np.minimum(alpha, math.pi / 2)) / long)

    def across_m2(self, seen: Sequence[Straight], depth_m: Array, covariance_px2: Array) -> Array:
        """By the lens's slope at each place."""
        slopes = np.array([[(at.u_x, at.u_y), (at.v_x, at.v_y)] for at in seen]).reshape(-1, 2, 2)
        back = np.linalg.inv(slopes)
        return np.asarray((depth_m**2)[:, None, None] * (back @ covariance_px2 @ back.transpose(0, 2, 1)))
