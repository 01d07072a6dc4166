"""Boxes about the ball in images, and whether there is anything to see in them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from kendama_cli.vision.interface import Image

LEAST_CONTRAST = 5.0
"""Of 255: boxes about the balls of three phone films have 16 and more, bare walls in them 1 to 4."""
BLURRED_HALVES = 1 / 6
"""Noise is taken out by a blur of this part of half a box."""
INSIDE, AROUND = 0.8, (1.1, 1.6)
"""In half boxes: what is compared."""


@dataclass(frozen=True)
class BallBox:
    """A box about the ball in an image: its middle and its sides [px]."""

    u_px: float
    v_px: float
    width_px: float
    height_px: float

    @property
    def radius_px(self) -> float:
        """Of the ball: motion blur makes the box longer, never narrower."""
        return min(self.width_px, self.height_px) / 2

    def contrast(self, pixels: Image) -> float:
        """How far a box stands out: sqrt(|m - m'|^2 + tr C), CIE Lab in 8 bits.

        m and C are mean and covariance of the colours in the ellipse within the box, m' the mean of those about it.
        Infinite where the box fills the image, so that there is nothing to compare.
        """
        u, v, reach = self.u_px, self.v_px, 2 * max(self.width_px, self.height_px)
        left, top = (max(int(middle - reach), 0) for middle in (u, v))
        right, bottom = (int(middle + reach) + 1 for middle in (u, v))
        part = np.ascontiguousarray(pixels[top:bottom, left:right])
        if part.size == 0:
            return float("inf")
        colours = cv2.cvtColor(part, cv2.COLOR_BGR2LAB).astype(np.float32)
        colours = np.asarray(cv2.GaussianBlur(colours, (0, 0), max(self.radius_px * BLURRED_HALVES, 0.3)))
        rows, columns = np.mgrid[: part.shape[0], : part.shape[1]]
        away = np.hypot((columns + left - u) / (self.width_px / 2), (rows + top - v) / (self.height_px / 2))
        inside, around = colours[away < INSIDE], colours[(away > AROUND[0]) & (away < AROUND[1])]
        if not (len(inside) and len(around)):
            return float("inf")
        apart = inside.mean(axis=0) - around.mean(axis=0)
        return float(np.sqrt(apart @ apart + inside.var(axis=0).sum()))


@dataclass(frozen=True)
class TaughtImage:
    """An image (h, w, 3) with a box about each ball in it; none: there is no ball in it."""

    pixels: Image
    boxes: tuple[BallBox, ...]
