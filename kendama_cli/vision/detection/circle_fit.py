"""The circle through a ball's outline, to a part of a pixel, from a rough place of it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Image, Sighting

DIRECTIONS = 48
STEP_PX = 0.5
CUTOFFS_PX = (1.5, 1.0, 0.6, 0.4)
"""Outline points farther than this from the circle are left out, pass by pass; noise and blur stay within 0.3 px."""
MIN_CONTRAST = 12.0
"""Grey levels between ball and surroundings along one direction; below, that direction shows no outline."""
RIM = 6
"""Samples at a ray's end that show the surroundings."""
CENTRED_PX = 0.4
"""A circle found from rays that meet so near to its centre is final: what is left is of second order, 0.01 px."""
ROUNDS = 4
_ANGLES = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
RAYS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
"""Unit vectors (n, 2) of the rays."""
DESIGN = np.column_stack([RAYS, np.ones(DIRECTIONS)])
"""About the rays' common centre the distance to a circle is DESIGN @ (shift u, shift v, radius)."""


@dataclass(frozen=True)
class Disc:
    """A rough place of the ball: ``centre`` (2,) and ``radius`` [px]."""

    centre: Array
    radius: float


class CircleFit:
    """Fits circles to outlines of which at least the part ``min_outline`` must be found.

    The outline is sought on rays from the disc's centre. Rays that end at the image's border, on an
    occluder or off the circle are left out, and the covariance sigma^2 (J^T J)^-1 of the circle's fit grows with every
    ray that is missing; it is at least ``sigma_floor_px``'s.
    """

    def __init__(self, *, min_radius_px: float, min_outline: float, sigma_floor_px: float) -> None:
        self._min_radius_px, self._min_outline, self._sigma_floor_px = min_radius_px, min_outline, sigma_floor_px

    def circle(self, pixels: Image, disc: Disc) -> Sighting | None:
        """Fit the circle about ``disc`` in ``pixels`` (h, w, 3), or None; its score is the fraction of the outline
        found.

        It is fitted again from its own centre until rays and outline meet at right angles.
        """
        for _ in range(ROUNDS):
            steps, profile, usable = _profile_along_rays(pixels, disc)
            if usable.sum() < self._least:
                return None
            found = self._fit(disc, *_through_contrast(steps, profile, usable))
            if found is None:
                return None
            moved = float(np.hypot(*(found.centre_px - disc.centre)))
            differs = abs(found.radius_px - disc.radius)
            if moved < CENTRED_PX and differs < 0.25 * found.radius_px:
                return found if found.radius_px >= self._min_radius_px else None
            disc = Disc(found.centre_px, found.radius_px)
        return None

    @property
    def _least(self) -> float:
        """The least number of rays that must meet the outline."""
        return max(5.0, self._min_outline * DIRECTIONS)

    def _fit(self, disc: Disc, reach: Array, usable: NDArray[np.bool_]) -> Sighting | None:
        """Fit the circle to outline points at ``reach`` (n,) from the disc's centre, outliers left out.

        About the rays' common centre the distance is linear in the circle's three unknowns:
        reach = radius + direction . shift.
        """
        least = self._least
        seen = reach[usable]
        if len(seen) < least:
            return None
        # what hides the ball makes rays shorter, never longer; half a disc still has the whole disc's outer circle
        most = int(0.7 * len(seen))
        circle = np.array([0.0, 0.0, np.partition(seen, most)[most]])
        for cutoff in CUTOFFS_PX:
            kept = usable & (np.abs(reach - DESIGN @ circle) < cutoff)
            count = int(kept.sum())
            if count < least:
                return None
            weighted = DESIGN * kept[:, None]
            inverse = np.linalg.inv(weighted.T @ DESIGN)
            circle = inverse @ (reach @ weighted)
        left = (reach - DESIGN @ circle)[kept]
        variance = float(left @ left) / max(count - 3, 1)
        covariance = inverse[:2, :2] * variance + np.eye(2) * self._sigma_floor_px**2
        return Sighting(disc.centre + circle[:2], np.asarray(covariance), float(circle[2]), count / DIRECTIONS)


def _profile_along_rays(pixels: Image, disc: Disc) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Sample rays from the disc's centre: steps, the image there, and a mask of the rays inside it."""
    height, width = pixels.shape[:2]
    radius = max(disc.radius, 1.0)
    steps = np.arange(0.5 * radius, 1.35 * radius + 3.0 + STEP_PX, STEP_PX)
    reach = float(steps[-1]) + 2
    left, top = (max(int(middle - reach), 0) for middle in disc.centre)
    right, bottom = (int(middle + reach) + 2 for middle in disc.centre)
    crop = pixels[top:bottom, left:right]
    if crop.size == 0:
        return steps, np.zeros((DIRECTIONS, len(steps), 3)), np.zeros(DIRECTIONS, dtype=np.bool_)
    columns, rows = ((disc.centre - (left, top))[:, None, None] + RAYS.T[:, :, None] * steps).astype(np.float32)
    ends = RAYS * steps[-1] + disc.centre
    usable = ((ends >= 0) & (ends <= (width - 1, height - 1))).all(axis=1)
    return steps, np.asarray(cv2.remap(crop, columns, rows, cv2.INTER_LINEAR), dtype=np.float32), usable


def _through_contrast(steps: Array, profile: Array, usable: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Return the distance of the outline of a ball of one colour on each ray, and where one was found.

    It lies where the image, projected on the line in colour space from surroundings to ball, falls through half of
    that ray's own contrast, so that shading does not shift it.
    """
    # the rays begin at half of the radius: what lies before 0.7 of it is the ball
    core = int(0.4 * float(steps[0]) / STEP_PX) + 1
    low, high = profile[:, -RIM:].sum(axis=1) / RIM, profile[:, :core].sum(axis=1) / core
    contrast = usable @ (high - low)
    length = float(np.linalg.norm(contrast))
    if length < MIN_CONTRAST * usable.sum():
        return np.zeros(len(usable)), np.zeros(len(usable), dtype=np.bool_)
    contrast /= length
    low, high, signal = low @ contrast, high @ contrast, profile @ contrast
    # each ray falls through the middle between its own two ends
    return _falls(steps, signal, (low + high) / 2, usable & (high - low > MIN_CONTRAST))


def _falls(steps: Array, signal: Array, level: Array, usable: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Return the steps at which each ray's ``signal`` (n, s) first falls through its ``level`` (n,), and if it does."""
    above = signal > level[:, None]
    falls = above[:, :-1] & ~above[:, 1:]
    at = falls.argmax(axis=1)
    every = np.arange(len(signal))
    found = usable & falls[every, at]
    before, after = signal[every, at], signal[every, at + 1]
    drop = np.where(found, before - after, 1.0)
    return steps[at] + STEP_PX * (before - level) / drop, found
