"""One camera's lens and the board's poses, from its views of a flat board alone, and checks of what views leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.radial_lens import RadialLens

MOST_RMS = 1.0 / 640
"""Largest residual that all views of a flat board leave over, in parts of the image's width."""
WORST_VIEW = 2.5
"""Times that: what one of them may leave, unless ..."""
APART = 8.0
"""... the median view leaves an eighth of it or more."""
TOGETHER = 3.0
"""Largest ratio of the residuals of cameras together to those of each alone, where their views are of one moment."""
NOISE = 0.25
"""Part of ``MOST_RMS`` that may come on top of that."""
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


def rms(residuals_px: Array) -> float:
    """Return the root mean square length of residuals (n, 2)."""
    return float(np.sqrt((residuals_px**2).sum(axis=1).mean()))


def check_views(name: str, views: Sequence[View], errors_px: Array, width_px: int) -> None:
    """Raise ValueError where a view of camera ``name``, or all of them, do not show what a flat board shows.

    ``errors_px`` (v,) is the rms that each leaves.
    """
    most, middle = MOST_RMS * width_px, float(np.median(errors_px))
    worst = int(errors_px.argmax())
    if errors_px[worst] > max(WORST_VIEW * most, APART * middle):
        raise ValueError(
            f"camera '{name}': view '{views[worst].name}' is off by {errors_px[worst]:.1f} px where the median view is "
            f"by {middle:.2f}; leave it out (blurred, bent, or of another board)"
        )
    whole = float(np.sqrt((errors_px**2).mean()))
    if whole > most:
        raise ValueError(
            f"camera '{name}': its views leave {whole:.1f} px, allowed: {most:.1f} (1 in 640 of the width); check that "
            "the board is flat, its columns and rows, and that the images are sharp"
        )


def check_moments(
    views: Mapping[str, Sequence[View]],
    alone_px: Mapping[str, Array],
    together: Mapping[str, Sequence[Array]],
    width_px: int,
) -> None:
    """Raise ValueError where cameras that each see a flat board do not see one board at one moment.

    By camera, ``alone_px`` (v,) is the rms that each view leaves where the camera is by itself, and ``together`` the
    residuals (n, 2) of each view after all cameras were adjusted together.
    """
    by_moment: dict[str, list[float]] = {}
    for name, left in together.items():
        for view, residuals_px in zip(views[name], left, strict=True):
            by_moment.setdefault(view.name, []).append(rms(residuals_px))
    shared = {moment: max(one) for moment, one in by_moment.items() if len(one) > 1}
    whole = float(np.sqrt(np.mean(np.square([*shared.values()]))))
    alone = max(float(np.sqrt((errors_px**2).mean())) for errors_px in alone_px.values())
    if whole > TOGETHER * alone + NOISE * MOST_RMS * width_px:
        worst = max(shared, key=lambda moment: shared[moment])
        raise ValueError(
            f"the cameras {', '.join(views)} leave {whole:.1f} px together where each alone leaves {alone:.2f}: views "
            f"of one name were not taken at one moment (worst: '{worst}', {shared[worst]:.1f} px); hold the board "
            "still, or synchronise the cameras"
        )


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
