"""One camera's lens and the board's poses, from its views of a flat board alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from kendama_cli.plugins.calibration.checks import check_views
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.radial_lens import RadialLens

MIN_VIEWS = 4
"""Fewer leave the focal length and the board's distance to be mistaken for each other."""
LEAST_TILT_DEG = 15.0
"""From parallel views a focal length comes out that is wrong several times over, with a small standard deviation."""
MOST_FOCAL_SIGMA = 0.1
"""Share of the focal length by which it may be uncertain, from one camera's views alone."""
FLAGS = cv2.CALIB_FIX_K3
"""k3 is left at 0: on ordinary lenses it only trades with k1 and k2, and goes wild towards the image's corners."""


class View(Protocol):
    """A view of the board: its name and its corners' pixels (n, 2)."""

    @property
    def name(self) -> str: ...

    @property
    def pixels(self) -> Array: ...


@dataclass(frozen=True)
class Intrinsics:
    """A lens of one camera, and the board in its axes by view."""

    numbers: Array
    """(8,): what of the lens is fitted"""
    focal_sigma_px: float
    rotations: Sequence[Array]
    shifts: Sequence[Array]
    errors_px: Array
    """(v,): rms of each view"""

    @property
    def lens(self) -> RadialLens:
        """The fitted lens."""
        return RadialLens(*self.numbers.tolist())


def intrinsics(name: str, views: Sequence[View], corners_m: Sequence[Array], size: tuple[int, int]) -> Intrinsics:
    """Fit the lens of camera ``name`` to its ``views`` of the corners (n_i, 3); ValueError if they do not suffice."""
    if len(views) < MIN_VIEWS:
        raise ValueError(
            f"camera '{name}': the board is seen in {len(views)} images, at least {MIN_VIEWS} are needed; check the "
            "board's size and take more images of it, tilted every way"
        )
    found = fit_lens(name, [view.pixels for view in views], corners_m, size)
    check_views(name, views, found.errors_px, size[0])
    normals = np.array([rotation[:, 2] for rotation in found.rotations])
    spread = float(np.degrees(np.arccos(np.clip(normals @ normals.T, -1, 1))).max())
    if not spread > LEAST_TILT_DEG:
        raise ValueError(
            f"camera '{name}': the board's tilt differs by {spread:.1f} degrees between its views, above "
            f"{LEAST_TILT_DEG:.0f} are needed to tell the focal length; tilt it by 20 degrees or more every way"
        )
    uncertain = found.focal_sigma_px / float(found.numbers[0])
    if not uncertain < MOST_FOCAL_SIGMA:
        raise ValueError(
            f"camera '{name}': its views tell the focal length to {uncertain:.0%} only, {MOST_FOCAL_SIGMA:.0%} at most "
            "are allowed; take more images, tilt the board by 30 degrees every way and bring it nearer"
        )
    return found


def fit_lens(name: str, seen_px: Sequence[Array], corners_m: Sequence[Array], size: tuple[int, int]) -> Intrinsics:
    """Fit a lens with radial distortion to corners (n_i, 2) and (n_i, 3) by OpenCV; ValueError where it cannot."""
    points = [one.astype(np.float32) for one in corners_m]
    pixels = [one.astype(np.float32)[:, None] for one in seen_px]
    try:
        _, matrix, distortion, rotations, shifts, sigma, _, errors = cv2.calibrateCameraExtended(
            points, pixels, size, np.eye(3), np.zeros(5), flags=FLAGS
        )
    except cv2.error as error:
        raise ValueError(f"camera '{name}': its views do not determine it ({error.err}); tilt the board more") from None
    (fx, _, cx), (_, fy, cy), _ = np.asarray(matrix, dtype=np.float64)
    return Intrinsics(
        numbers=np.array([fx, fy, cx, cy, *np.asarray(distortion, dtype=np.float64).ravel()[:4]]),
        focal_sigma_px=float(np.asarray(sigma).ravel()[0]),
        rotations=[np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64) for rotation in rotations],
        shifts=[np.asarray(shift, dtype=np.float64) for shift in shifts],
        errors_px=np.asarray(errors, dtype=np.float64).ravel(),
    )
