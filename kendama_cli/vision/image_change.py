"""How an image differs from its background, pixel by pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.interface import Image

NOISE_SIGMAS = 6.0
"""A difference from the background counts from so many standard deviations of the image's noise on."""
MAD_SIGMA = 1.4826
"""Standard deviation of a Gaussian over its median absolute deviation."""


@dataclass(frozen=True)
class ImageChange:
    """An image (h, w, 3), its background, and their difference."""

    pixels: Image
    background: Image
    amount: Image
    """(h, w) the greatest absolute difference of the three colours [grey levels]"""
    least: float
    """difference from which on something is there [grey levels]"""

    def lighter(self) -> NDArray[np.bool_]:
        """Where (h, w) the image is lighter than the background."""
        here, before = (cv2.cvtColor(one, cv2.COLOR_BGR2GRAY) for one in (self.pixels, self.background))
        return np.asarray(np.asarray(here) > np.asarray(before))

    def part(self, rows: slice, columns: slice) -> ImageChange:
        """Some rows and columns, with the same ``least``."""
        box = rows, columns
        pixels, background = (np.ascontiguousarray(one[box]) for one in (self.pixels, self.background))
        return ImageChange(pixels, background, np.ascontiguousarray(self.amount[box]), self.least)

    def scaled(self, factor: float) -> ImageChange:
        """Made smaller, each pixel the mean of those that it covers, with the same ``least``."""
        if factor >= 1:
            return self
        pixels, background, amount = (
            np.asarray(cv2.resize(one, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA), dtype=np.uint8)
            for one in (self.pixels, self.background, self.amount)
        )
        return ImageChange(pixels, background, amount, self.least)


def change_of(pixels: Image, background: Image, contrast_min: float) -> ImageChange:
    """The difference of an image and its background; it counts from ``contrast_min`` on, above the image's noise."""
    blue, green, red = cv2.split(cv2.absdiff(pixels, background))
    amount = np.asarray(cv2.max(cv2.max(blue, green), red), dtype=np.uint8)
    counts = np.bincount(amount.ravel(), minlength=256)
    middle = _median(counts)
    noise = MAD_SIGMA * _median(np.bincount(np.abs(np.arange(256) - middle), weights=counts, minlength=256))
    return ImageChange(pixels, background, amount, max(contrast_min, middle + NOISE_SIGMAS * noise))


def _median(counts: NDArray[np.float64] | NDArray[np.intp]) -> int:
    """The median of values 0, 1, ... that occur so many times."""
    return int(np.searchsorted(np.cumsum(counts), counts.sum() / 2))
