"""Copies of a taught image about its ball: before other backgrounds, nearer or farther, blurred, in other light."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.interface import Image
from kendama_cli.vision.patch_features import BALL_PX

Values = NDArray[np.float32]

LONGEST_BLUR = 2.5
"""In ball radii."""
BLURRED = 0.7
RIM = 0.95
"""The part of a box's ellipse that surely shows the ball."""
ZOOM = 0.15
"""A ball is shown larger or smaller by up to this part."""


def zoomed(
    crop: Image, free: NDArray[np.bool_], middle_px: tuple[float, float], rng: np.random.Generator
) -> tuple[Image, NDArray[np.bool_], float]:
    """The crop (h, w, 3) larger or smaller about ``middle_px`` (column, row), where it then shows no ball (h, w), and
    by which factor; ``free`` (h, w) says where the crop shows none. What lies beyond the crop is mirrored in."""
    factor = float(rng.uniform(1 - ZOOM, 1 + ZOOM))
    u, v = middle_px
    way = np.array([[factor, 0, (1 - factor) * u], [0, factor, (1 - factor) * v]])
    size = crop.shape[1], crop.shape[0]
    made = np.asarray(cv2.warpAffine(crop, way, size, borderMode=cv2.BORDER_REFLECT_101), dtype=np.uint8)
    shows_none = cv2.warpAffine(free.astype(np.uint8), way, size, flags=cv2.INTER_NEAREST, borderValue=0)
    return made, np.asarray(shows_none, dtype=np.bool_), factor


def varied(crop: Image, rng: np.random.Generator) -> Image:
    """The crop under other light, and mostly blurred along a line."""
    values = crop.astype(np.float32)
    if rng.random() < BLURRED:
        values = np.asarray(cv2.filter2D(values, -1, _any_line(rng)), dtype=np.float32)
    return _lit(values, rng)


def before(background: Image, crop: Image, half_boxes: NDArray[np.float64], rng: np.random.Generator) -> Image:
    """The ball of the ``crop`` before a ``background`` of the same shape, mostly blurred by its own motion.

    ``half_boxes`` (h, w) is each pixel's distance from the box's middle, in half boxes.
    """
    cover = np.clip((RIM - half_boxes) * BALL_PX + 0.5, 0, 1).astype(np.float32)[..., None]
    ball = cover * crop.astype(np.float32) * np.float32(rng.uniform(0.85, 1.15))
    if rng.random() < BLURRED:
        line = _any_line(rng)
        ball = np.asarray(cv2.filter2D(ball, -1, line), dtype=np.float32)
        cover = np.asarray(cv2.filter2D(cover, -1, line), dtype=np.float32)[..., None]
    return _lit(ball + (1 - cover) * background.astype(np.float32), rng)


def _lit(values: Values, rng: np.random.Generator) -> Image:
    values = values * np.float32(rng.uniform(0.8, 1.25)) * rng.uniform(0.94, 1.06, 3).astype(np.float32)
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _any_line(rng: np.random.Generator) -> Values:
    length, angle = rng.uniform(2, LONGEST_BLUR * BALL_PX), rng.uniform(0, np.pi)
    return _line(length, angle)


def _line(length_px: float, angle_rad: float) -> Values:
    """A kernel that blurs along a line."""
    half = int(np.ceil(length_px / 2))
    kernel = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
    for way in np.linspace(-length_px / 2, length_px / 2, 8 * half + 4):
        kernel[round(half + way * np.sin(angle_rad)), round(half + way * np.cos(angle_rad))] += 1
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)
