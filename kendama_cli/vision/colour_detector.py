"""Finding the ball in an image: colour, outline, circle; 'not seen' instead of a guess."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.colour import ColourModel, HsvThresholds
from kendama_cli.vision.interface import Image, SearchHint, Sighting
from kendama_cli.vision.settings import ColourDetectorSettings

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
COARSE_PIXELS = 120 * 120
"""In a larger image every second pixel is enough to say where to look."""
CANDIDATES = 3


@dataclass(frozen=True)
class _Disc:
    centre: Array
    radius: float


class ColourDetector:
    """A patch of the ball's colour, then a circle through the sub-pixel outline of it.

    The outline is sought on rays from the patch's centre: where the image, projected on the line in colour space from
    surroundings to ball, falls through half of that ray's own contrast, so that shading does not shift it. Rays that
    end at the image's border, on an occluder or off the circle are left out, and the covariance
    sigma^2 (J^T J)^-1 of the circle's fit grows with every ray that is missing.
    """

    def __init__(self, settings: ColourDetectorSettings, colour: ColourModel | None = None) -> None:
        self._settings = settings
        self._colour = colour or HsvThresholds(settings)
        angle = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        self._directions = np.column_stack([np.cos(angle), np.sin(angle)])
        self._every = np.arange(DIRECTIONS)
        self._design = np.column_stack([self._directions, np.ones(DIRECTIONS)])

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """See Detector: the nearest to ``hint`` first, without it the largest; the score is the part of the outline."""
        corner = np.array(origin_px, dtype=np.float64)
        near = None if hint is None else np.asarray(hint.centre_px, dtype=np.float64) - corner
        for disc in self._patches(pixels, near):
            found = self._circle(pixels, disc)
            if found is not None:
                yield Sighting(found.centre_px + corner, found.covariance_px2, found.radius_px, found.score)

    def _patches(self, pixels: Image, near: Array | None) -> Sequence[_Disc]:
        """Discs about the patches of the ball's colour, the most likely first."""
        step = 2 if pixels.shape[0] * pixels.shape[1] > COARSE_PIXELS else 1
        mask = self._colour.mask(np.ascontiguousarray(pixels[::step, ::step]))
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        found = []
        for contour in sorted(contours, key=cv2.contourArea, reverse=True)[:CANDIDATES]:
            (u, v), radius = cv2.minEnclosingCircle(contour)
            if step * (radius + 0.5) >= self._settings.min_radius_px:
                found.append(_Disc(np.array([step * u, step * v]), step * float(radius)))
        if near is not None:
            found.sort(key=lambda disc: float(np.hypot(*(disc.centre - near))))
        return found

    def _circle(self, pixels: Image, disc: _Disc) -> Sighting | None:
        """Fit the circle, again from its own centre until rays and outline meet at right angles."""
        for _ in range(ROUNDS):
            found = self._fit(disc.centre, *self._outline(pixels, disc))
            if found is None:
                return None
            moved = float(np.hypot(*(found.centre_px - disc.centre)))
            if moved < CENTRED_PX and abs(found.radius_px - disc.radius) < 0.25 * found.radius_px:
                return found if found.radius_px >= self._settings.min_radius_px else None
            disc = _Disc(found.centre_px, found.radius_px)
        return None

    def _outline(self, pixels: Image, disc: _Disc) -> tuple[Array, NDArray[np.bool_]]:
        """Distance of the outline from the disc's centre along every direction, and where it was found."""
        height, width = pixels.shape[:2]
        radius = max(disc.radius, 1.0)
        outer = 1.35 * radius + 3.0
        steps = np.arange(0.5 * radius, outer + STEP_PX, STEP_PX)
        reach = float(steps[-1]) + 2
        left, top = (max(int(middle - reach), 0) for middle in disc.centre)
        right, bottom = (int(middle + reach) + 2 for middle in disc.centre)
        crop = pixels[top:bottom, left:right]
        columns, rows = ((disc.centre - (left, top))[:, None, None] + self._directions.T[:, :, None] * steps).astype(
            np.float32
        )
        ends = self._directions * steps[-1] + disc.centre
        usable = ((ends >= 0) & (ends <= (width - 1, height - 1))).all(axis=1)
        nothing = np.zeros(DIRECTIONS), np.zeros(DIRECTIONS, dtype=np.bool_)
        if crop.size == 0 or usable.sum() < self._settings.min_outline * DIRECTIONS:
            return nothing
        profile = np.asarray(cv2.remap(crop, columns, rows, cv2.INTER_LINEAR), dtype=np.float32)
        core = int(0.2 * radius / STEP_PX) + 1
        low, high = profile[:, -RIM:].sum(axis=1) / RIM, profile[:, :core].sum(axis=1) / core
        contrast = usable @ (high - low)
        length = float(np.linalg.norm(contrast))
        if length < MIN_CONTRAST * usable.sum():
            return nothing
        contrast /= length
        low, high, signal = low @ contrast, high @ contrast, profile @ contrast
        # each ray falls through the middle between its own two ends
        middle = (low + high) / 2
        above = signal > middle[:, None]
        falls = above[:, :-1] & ~above[:, 1:]
        first = falls.argmax(axis=1)
        found = usable & (high - low > MIN_CONTRAST) & falls[self._every, first]
        before, after = signal[self._every, first], signal[self._every, first + 1]
        drop = np.where(found, before - after, 1.0)
        return steps[first] + STEP_PX * (before - middle) / drop, found

    def _fit(self, centre: Array, reach: Array, usable: NDArray[np.bool_]) -> Sighting | None:
        """The circle through outline points at distance ``reach`` (n,) from ``centre``, outliers left out.

        About the rays' common centre the distance is linear in the circle's three unknowns:
        reach = radius + direction . shift.
        """
        least = max(5, self._settings.min_outline * DIRECTIONS)
        seen = reach[usable]
        if len(seen) < least:
            return None
        # what hides the ball makes rays shorter, never longer; half a disc still has the whole disc's outer circle
        most = int(0.7 * len(seen))
        circle = np.array([0.0, 0.0, np.partition(seen, most)[most]])
        for cutoff in CUTOFFS_PX:
            kept = usable & (np.abs(reach - self._design @ circle) < cutoff)
            count = int(kept.sum())
            if count < least:
                return None
            weighted = self._design * kept[:, None]
            inverse = np.linalg.inv(weighted.T @ self._design)
            circle = inverse @ (reach @ weighted)
        left = (reach - self._design @ circle)[kept]
        variance = float(left @ left) / max(count - 3, 1)
        covariance = inverse[:2, :2] * variance + np.eye(2) * self._settings.sigma_floor_px**2
        return Sighting(centre + circle[:2], np.asarray(covariance), float(circle[2]), count / DIRECTIONS)
