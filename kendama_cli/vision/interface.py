"""What finds the ball in an image: candidates with place, size, score and covariance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array

Image = NDArray[np.uint8]


@dataclass(frozen=True)
class Streak:
    """What a ball leaves that moves while the shutter is open; its centre is where it was at mid-exposure."""

    way_px: Array
    """(2,) from one end of the exposure to the other; which end came first one image cannot say"""
    covariance_px2: Array
    """(4, 4) of centre and way"""


@dataclass(frozen=True)
class Sighting:
    """A disc in one image that may be the ball's; ``score`` in 0..1 says how well it looks like it."""

    centre_px: Array
    """(2,) column and row"""
    covariance_px2: Array
    """(2, 2) of the centre"""
    radius_px: float
    score: float
    streak: Streak | None = None
    """its motion within the exposure, where the image shows one"""
    painted: bool = False
    """whether its outline is that of a ball of several colours"""


@dataclass(frozen=True)
class SearchHint:
    """What is known of where the ball is: its expected centre (2,) [px] and radius [px], in the whole image."""

    centre_px: Array
    radius_px: float
    is_sized: bool = False
    """whether the radius is that of the ball where it is, to a few per cent, rather than the last one seen"""
    painted_px: float | None = None
    """the radius to a per cent, of a ball known to have several colours"""


class Detector(Protocol):
    """Finds the ball in images of one camera, each for itself: nothing is remembered from image to image."""

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """What may be the ball in ``pixels`` (h, w, 3) blue, green, red, the most likely first; nothing for "not seen".

        ``origin_px`` is the column and row of ``pixels[0, 0]`` in the whole image, in which centres and ``hint`` count.
        Candidates are computed as they are asked for.
        """


@runtime_checkable
class BackgroundDetector(Detector, Protocol):
    """A detector that must know what its camera sees behind the ball; it serves one camera alone."""

    def learn(self, images: Sequence[Image]) -> None:
        """Take the background from whole images (h, w, 3) of one camera."""
