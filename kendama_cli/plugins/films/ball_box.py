"""Boxes about the ball in images, and whether there is anything to see in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from kendama_cli.vision.detection.interface import Image

LEAST_CONTRAST = 5.0
"""Of 255: boxes about the balls of three phone films have 16 and more, bare walls in them 1 to 4."""
FEWEST_BOXES = 3
"""From so many on boxes can be compared with each other."""
LEAST_SIDE_PX = 4.0
MOST_PART = 0.25
"""Of the image's area: about a ball that fills more nothing is left to tell it from."""
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
        """Return the ball's radius: motion blur makes the box longer, never narrower."""
        return min(self.width_px, self.height_px) / 2

    def contrast(self, pixels: Image) -> float:
        """Return the contrast of a box to its surroundings: sqrt(|m - m'|^2 + tr C), CIE Lab in 8 bits.

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
class TrainedImage:
    """An image (h, w, 3) with a box about each ball in it; none: there is no ball in it."""

    pixels: Image
    boxes: tuple[BallBox, ...]


def refuse_boxes(images: Sequence[TrainedImage]) -> None:
    """Raises ValueError where there is no box, or one is too small, covers too much of its image, or is on a plain
    surface."""
    boxes = [box for image in images for box in image.boxes]
    if not boxes:
        raise ValueError(f"none of {len(images)} images has a box about the ball")
    small = min(boxes, key=lambda box: box.radius_px)
    if 2 * small.radius_px < LEAST_SIDE_PX:
        raise ValueError(
            f"a box of {small.width_px:.1f} x {small.height_px:.1f} px: a ball needs {LEAST_SIDE_PX:g} px at the least"
        )
    for number, image in enumerate(images, start=1):
        for box in image.boxes:
            where = f"the box at {box.u_px:.0f},{box.v_px:.0f} in image {number}"
            part = box.width_px * box.height_px / (image.pixels.shape[0] * image.pixels.shape[1])
            if part > MOST_PART:
                raise ValueError(f"{where} covers {part:.0%} of the image, allowed: {MOST_PART:.0%} and less")
            if (stands_out := box.contrast(image.pixels)) < LEAST_CONTRAST:
                raise ValueError(
                    f"{where} shows a plain surface: contrast {stands_out:.1f} of 255, allowed: {LEAST_CONTRAST:g} and "
                    "more"
                )
