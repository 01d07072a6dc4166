"""What a camera's lens does, in the camera's axes (x right, y down, z forward): everything that knows distortion.

The rest of the package asks a camera's ``optics``; a lens of another kind is another class here, with this interface.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import LensKind
from kendama_cli.vision.fisheye_lens import FisheyeLens
from kendama_cli.vision.lens_terms import Pinhole, Straight
from kendama_cli.vision.radial_lens import RadialLens


class Lens(Protocol):
    """A lens with the image behind it; equal to another with the same numbers."""

    def project(self, points_m: Array) -> Array:
        """Pixels (n, 2) of ``points_m`` (n, 3); nan for a point that it does not see."""

    def undistort(self, pixels: Array) -> Array:
        """Normalised image coordinates (x, y) (n, 2) of ``pixels`` (n, 2); nan for a pixel that sees nothing ahead."""

    def straight(self, u: float, v: float) -> Straight:
        """One pixel with the distortion taken out, and the slope of the distortion there."""

    def sees(self, pixels: Array) -> NDArray[np.bool_]:
        """Which (n,) of ``pixels`` (n, 2) light from ahead reaches."""

    def image_rays(self, pixels: Array) -> Array:
        """Directions (n, 3) to render ``pixels`` (n, 2) by: one for each, smooth, none of them nan."""

    @property
    def coarsest_px(self) -> float:
        """The fewest pixels that it gives to a way of 1 across an image ray, anywhere."""

    def posed(self, points_m: Array, turn: ArrayLike, shift: ArrayLike) -> tuple[Array, Array]:
        """Pixels (n, 2) of points (n, 3) of a body at the pose ``turn`` (rotation vector) and ``shift``, and their
        slopes (2 n, 6 + FITTED) by turn, shift and what a calibration finds."""

    def place_slopes(self, points_m: Array) -> Array:
        """d(pixel) / d(point) (n, 2, 3) at ``points_m`` (n, 3)."""

    def pinhole(self, pixels: Array) -> Pinhole:
        """What OpenCV's solvers, which know pinhole cameras, take in the place of ``pixels`` (n, 2)."""

    def refined(self, points_m: Array, pixels: Array, turn: ArrayLike, shift: ArrayLike) -> tuple[Array, Array]:
        """The pose near ``turn`` and ``shift`` at which the points' pixels are nearest to ``pixels`` (n, 2)."""

    def sphere_centre(self, disc_px: Array, radius_px: float) -> Array:
        """The image (2,) of a sphere's centre, from the centre (2,) and the mean radius of its disc."""

    def size_px(self, place_m: Array, radius_m: float) -> float:
        """The mean radius of the disc of a sphere of ``radius_m`` at ``place_m`` (3,)."""

    def depth_m(self, rays: Array, radius_px: Array, radius_m: float) -> Array:
        """Depth (n,) of a sphere seen along ``rays`` (n, 3), of length 1 along the axis, with such mean radii (n,)."""

    def across_m2(self, seen: Sequence[Straight], depth_m: Array, covariance_px2: Array) -> Array:
        """Covariances (n, 2, 2) of x and y at the depths (n,), from those of the pixels (n, 2, 2)."""


def make_lens(kind: LensKind, focal_px: Array, center_px: Array, distortion: Array) -> RadialLens | FisheyeLens:
    """The lens of ``kind``; raises ValueError for numbers that it has no use for."""
    numbers = [float(value) for value in (*focal_px, *center_px, *distortion)]
    return LENSES[kind](*numbers)


LENSES: dict[LensKind, type[RadialLens | FisheyeLens]] = {"radial": RadialLens, "fisheye": FisheyeLens}
