"""Finding the ball in an image: colour, outline, circle; 'not seen' instead of a guess."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2
import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.circle_fit import CircleFit, Disc
from kendama_cli.vision.detection.colour import ColourModel, HsvThresholds
from kendama_cli.vision.detection.interface import Image, SearchHint, Sighting
from kendama_cli.vision.settings import ColourDetectorSettings

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
