"""What a camera that stands still sees behind the ball."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.interface import Image

SHAKE_SCALE = 0.5
LEAST_SHAKE_PX, SHAKE_PX = 0.3, 3.0
"""A camera on a table moves less; more is no shake but another view."""
LESS = 0.9
"""A shake is believed where it leaves less than this part of the difference."""
EVERY_PX = 3
"""The exposure is judged on every so many rows and columns."""
DARKEST, BRIGHTEST = 25, 230
"""Levels that tell of the exposure: below it is noise that they hold, above the sensor is full."""
FEWEST = 50
"""So many pixels of such levels tell the exposure; fewer tell nothing."""
LEAST_GAIN, MOST_GAIN = 0.01, 0.4
"""An exposure that differs by less changes nothing that is seen, by more it is another light."""


class Background:
    """The median over time of a camera's images, and how it would look in an image that was taken since.

    Between images a camera on a table shakes by a pixel or two, and its automatic exposure and white balance drift by
    some per cent: either would make every edge, or the whole wall, differ.
    """

    def __init__(self, images: Sequence[Image]) -> None:
        """From images (h, w, 3) of one camera, spread over time: what moves must not cover a place in half of them."""
        stack = np.array(images)
        self._pixels: Image = np.partition(stack, len(stack) // 2, axis=0)[len(stack) // 2]
        self._small = _small(self._pixels)
        self._window = cv2.createHanningWindow(self._small.shape[::-1], cv2.CV_32F)

    def behind(self, pixels: Image, origin_px: tuple[int, int]) -> Image | None:
        """The background (h, w, 3) as it is in ``pixels``, whose upper left is at ``origin_px`` of the whole image.

        None where ``pixels`` do not lie in the whole image.
        """
        left, top = origin_px
        height, width = pixels.shape[:2]
        there = self._pixels[top : top + height, left : left + width]
        if pixels.size == 0 or there.shape != pixels.shape:
            return None
        return _as_exposed(pixels, self._as_shaken(pixels, there))

    def _as_shaken(self, pixels: Image, background: Image) -> Image:
        """The background moved as the camera shook, where the whole image says so."""
        if pixels.shape != self._pixels.shape:
            return background
        # OpenCV 5.0 multiplies its inputs by the window in place where their size needs no padding
        right, down = cv2.phaseCorrelate(self._small.copy(), _small(pixels), self._window)[0]
        right, down = right / SHAKE_SCALE, down / SHAKE_SCALE
        if not LEAST_SHAKE_PX < float(np.hypot(right, down)) <= SHAKE_PX:
            return background
        way = np.array([[1, 0, right], [0, 1, down]], dtype=np.float64)
        size = background.shape[1], background.shape[0]
        moved = np.asarray(cv2.warpAffine(background, way, size, borderMode=cv2.BORDER_REPLICATE), dtype=np.uint8)
        # what moved in the image pulls the correlation along: a true shake leaves less difference
        left = [float(cv2.norm(pixels, one, cv2.NORM_L1)) for one in (background, moved)]
        return moved if left[1] < LESS * left[0] else background


def _as_exposed(pixels: Image, background: Image) -> Image:
    """The background as bright as ``pixels`` are, each colour by the median ratio: most of an image is no ball."""
    now, before = (one[::EVERY_PX, ::EVERY_PX].reshape(-1, 3) for one in (pixels, background))
    tells = ((before > DARKEST) & (before < BRIGHTEST) & (now < BRIGHTEST)).all(axis=1)
    if int(tells.sum()) < FEWEST:
        return background
    gain = np.median(now[tells] / before[tells], axis=0)
    change = float(np.abs(gain - 1).max())
    if not LEAST_GAIN < change <= MOST_GAIN:
        return background
    levels = np.clip(np.rint(np.arange(256)[:, None] * gain), 0, 255).astype(np.uint8)
    return np.asarray(cv2.LUT(background, levels[:, None, :]), dtype=np.uint8)


def _small(pixels: Image) -> NDArray[np.float32]:
    """The image's grey at SHAKE_SCALE."""
    small = cv2.resize(pixels, None, fx=SHAKE_SCALE, fy=SHAKE_SCALE, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY), dtype=np.float32)
