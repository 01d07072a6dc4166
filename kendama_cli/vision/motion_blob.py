"""What differs from the background, part by part."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.interface import Image


@dataclass(frozen=True)
class Blob:
    """A connected part of what differs from the background."""

    centre_px: NDArray[np.float64]
    radius_px: float
    roundness: float
    """its area over that of the circle about it, 0..1"""
    least: float
    """difference from which on something is there"""
    new: float
    """part of its rim's contrast that this image has rather than the background, 0..1"""
    way_px: NDArray[np.float64]
    """(2,) from one end to the other of the disc that moved, were it a streak"""
    width_px: float
    """across that"""
    filled: float
    """its area over that of such a streak"""


def _slope(pixels: Image) -> NDArray[np.float32]:
    grey = cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY)
    return np.asarray(np.hypot(cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)), dtype=np.float32)


def blob_of(contour: NDArray[np.int32], least: float, change: Image, pixels: Image, background: Image) -> Blob | None:
    if len(contour) < 6 or float(cv2.contourArea(contour)) < 4:
        return None
    left, top, width, height = cv2.boundingRect(contour)
    box = slice(top, top + height), slice(left, left + width)
    inside = np.zeros((height, width), dtype=np.uint8)
    cv2.drawContours(inside, [contour], -1, 1, -1, offset=(-left, -top))
    weight = inside * change[box].astype(np.float64)
    weight = np.minimum(weight, np.median(weight[inside > 0]))
    total = float(weight.sum())
    if total <= 0:
        return None
    u = left + float(weight.sum(axis=0) @ np.arange(width)) / total
    v = top + float(weight.sum(axis=1) @ np.arange(height)) / total
    area = float(inside.sum())
    enclosing = float(cv2.minEnclosingCircle(contour)[1])
    rows, columns = contour[:, 0, 1] - top, contour[:, 0, 0] - left
    here, before = (float(_slope(np.ascontiguousarray(one[box]))[rows, columns].sum()) for one in (pixels, background))
    new = here / (here + before) if here + before > 0 else 0.0
    roundness = area / (np.pi * (enclosing + 0.5) ** 2)
    way, width_px = _capsule(contour)
    filled = area / max(np.pi * width_px**2 / 4 + width_px * float(np.hypot(*way)), 1.0)
    centre, radius = np.array([u, v]), float(np.sqrt(area / np.pi))
    return Blob(centre, radius, float(min(roundness, 1.0)), least, new, way, width_px, float(min(filled, 1.0)))


def _capsule(contour: NDArray[np.int32]) -> tuple[NDArray[np.float64], float]:
    """The way (2,) of a disc that fills the narrowest rectangle about the contour as it moves, and its width."""
    corners = np.asarray(cv2.boxPoints(cv2.minAreaRect(contour)), dtype=np.float64)
    sides = corners[1] - corners[0], corners[2] - corners[1]
    long, short = sorted(sides, key=lambda side: -float(np.hypot(*side)))
    length, width = float(np.hypot(*long)), float(np.hypot(*short))
    way = long * ((length - width) / length) if length > 0 else np.zeros(2)
    return way, width + 1
