"""A detector whose sightings are placed by the ball's region in the film."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from kendama_cli.vision.ball_region import BallRegion
from kendama_cli.vision.interface import Detector, Image, SearchHint, Sighting


class RegionDetector:
    """The sightings of ``detector``, each moved to the disc that the ball's colours fill, with its radius."""

    def __init__(self, detector: Detector, region: BallRegion) -> None:
        self._detector, self._region = detector, region

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """See Detector."""
        corner = np.array(origin_px, dtype=np.float64)
        for one in self._detector.candidates(pixels, origin_px, hint):
            placed = self._region.placed(pixels, dataclasses.replace(one, centre_px=one.centre_px - corner))
            yield dataclasses.replace(placed, centre_px=placed.centre_px + corner)
