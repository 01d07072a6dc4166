"""Interface of detectors of the ball in an image: candidates with position, size, score and covariance."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kendama_cli.log.messages import DetectionMessage
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.settings import DETECTORS, DetectorSettings

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class Sighting:
    """A disc in one image that may be the ball's; ``score`` in 0..1 says how well it looks like it."""

    centre_px: Array
    """(2,) column and row"""
    covariance_px2: Array
    """(2, 2) of the centre"""
    radius_px: float
    score: float


def detection_message(flight: int, camera: str, seen: Sighting | None) -> DetectionMessage:
    """Return the log's message of one image of a flight."""
    if seen is None:
        return DetectionMessage(flight, camera, np.nan, np.nan, np.nan, seen=False)
    u_px, v_px = seen.centre_px.tolist()
    return DetectionMessage(
        flight, camera, u_px, v_px, seen.radius_px, seen=True, covariance_px2=seen.covariance_px2.ravel()
    )


@dataclass(frozen=True)
class SearchHint:
    """Expected centre (2,) [px] and radius [px] of the ball, in the whole image."""

    centre_px: Array
    radius_px: float


class Detector(Protocol):
    """Finds the ball in images of one camera, each for itself: nothing is remembered from image to image."""

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """Yield candidates for the ball in ``pixels`` (h, w, 3) BGR, the most likely first; none for "not seen".

        ``origin_px`` is the column and row of ``pixels[0, 0]`` in the whole image, in which centres and ``hint`` count.
        Candidates are computed as they are asked for.
        """


def make_detector(settings: DetectorSettings) -> Detector:
    """Make the detector that ``settings`` choose; raises InputError if a file of its own cannot be read."""
    made: Detector = DETECTORS.maker(settings.kind)(settings)
    return made
