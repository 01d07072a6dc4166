"""Detector of the ball by its colour: a patch, the circle through its outline, and a learned colour's file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.colour import ColourModel, HsvThresholds, LearnedColour
from kendama_cli.vision.detection.interface import Image, SearchHint, Sighting
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
_ANGLES = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
RAYS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
"""Unit vectors (n, 2) of the rays."""
DESIGN = np.column_stack([RAYS, np.ones(DIRECTIONS)])
"""About the rays' common centre the distance to a circle is DESIGN @ (shift u, shift v, radius)."""


@dataclass(frozen=True)
class Disc:
    """A rough position of the ball: ``centre`` (2,) and ``radius`` [px]."""

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
    left, top = (max(int(center - reach), 0) for center in disc.centre)
    right, bottom = (int(center + reach) + 2 for center in disc.centre)
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


COARSE_PIXELS = 120 * 120
"""In a larger image every second pixel is enough to say where to look."""
CANDIDATES = 3


class ColourDetector:
    """A patch of the ball's colour, then a circle through its outline (``CircleFit``)."""

    def __init__(self, settings: ColourDetectorSettings, colour: ColourModel | None = None) -> None:
        self._settings = settings
        self._colour = colour or HsvThresholds(settings)
        self._fit = CircleFit(
            min_radius_px=settings.min_radius_px,
            min_outline=settings.min_outline,
            sigma_floor_px=settings.sigma_floor_px,
        )

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """See Detector: the nearest to ``hint`` first, without it the largest; the score is the part of the outline."""
        corner = np.array(origin_px, dtype=np.float64)
        near = None if hint is None else np.asarray(hint.centre_px, dtype=np.float64) - corner
        for disc in self._patches(pixels, near):
            found = self._fit.circle(pixels, disc)
            if found is not None:
                yield Sighting(found.centre_px + corner, found.covariance_px2, found.radius_px, found.score)

    def _patches(self, pixels: Image, near: Array | None) -> Sequence[Disc]:
        """Discs about the patches of the ball's colour, the most likely first."""
        step = 2 if pixels.shape[0] * pixels.shape[1] > COARSE_PIXELS else 1
        mask = self._colour.mask(np.ascontiguousarray(pixels[::step, ::step]))
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        found = []
        for contour in sorted(contours, key=cv2.contourArea, reverse=True)[:CANDIDATES]:
            (u, v), radius = cv2.minEnclosingCircle(contour)
            if step * (radius + 0.5) >= self._settings.min_radius_px:
                found.append(Disc(np.array([step * u, step * v]), step * float(radius)))
        if near is not None:
            found.sort(key=lambda disc: float(np.hypot(*(disc.centre - near))))
        return found


REMEDY = "learn the colour again, or set predict.detector.colour=null to go by its thresholds"


def colour_detector(settings: ColourDetectorSettings) -> ColourDetector:
    """Make the detector with the learned colour if ``settings`` name one, else with their thresholds."""
    return ColourDetector(settings, None if settings.colour is None else read_colour(settings.colour))


def read_colour(path: str) -> LearnedColour:
    """Read the colour model; raises InputError for a file that is not there or holds none."""
    try:
        return LearnedColour.from_json(Path(path).read_text(encoding="utf-8"))
    except OSError as wrong:
        raise InputError(path, f"cannot be read ({wrong.strerror})", remedy=REMEDY) from None
    except ValueError as wrong:
        raise InputError(path, str(wrong), remedy=REMEDY) from None
