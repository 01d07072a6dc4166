"""What differs from the background, part by part."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.image_change import ImageChange
from kendama_cli.vision.interface import Image

STRING_PART = 0.35
"""What is thinner than this part of the ball's diameter is the string: it is opened away."""
GAP_PART = 0.3
"""Between two colours of a ball lies a line of the background's own brightness, up to twice this part of its radius."""
ROUND, ROUND_UNEVEN, UNEVEN = 0.7, 0.8, 0.6
"""What is less round is no ball alone; nor is what is not quite round and differs more at one end than at the other."""
PARTS = ((1.0, 0.7), (1.6, STRING_PART), (2.5, STRING_PART), (4.0, STRING_PART), (6.5, STRING_PART))
"""Parts are what is left above so many times the least difference when what is thinner than that part is opened away:
a string, the soft rim of a shadow and a hand before a like wall differ less than the ball, or are thinner."""
SIDE_LEVELS = (1.0, 2.5)
"""... and what is lighter than the background, or darker, or no shadow, from so many times the least difference on."""

SHADOW = (0.45, 0.97)
"""A shadow leaves such a part of the light; in numbers that hold light^(1/2.2), 0.17 to 0.94 of it."""
SAME_FACTOR, DARKEST = 0.08, 20
"""Colours are darker by the same factor where those differ by less, as far as levels above DARKEST tell."""
SHADE_PART = 0.5
"""What is all shadow is half as likely the ball: a grey ball before a grey wall looks the same, but then alone."""

LONG, FILLED, EVEN, STREAK_OCTAVES = 0.5, 0.8, 0.4, 0.7
"""A streak's way is longer than this part of its width; it fills so much of that shape, differs about as much at both
ends, and is as wide as the ball to so many octaves."""


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
    shade: float
    """part of it that only is darker than the background, by the same factor in all colours, 0..1"""
    way_px: NDArray[np.float64]
    """(2,) from one end to the other of the disc that moved, were it a streak"""
    width_px: float
    """across that"""
    filled: float
    """its area over that of such a streak"""
    even: float
    """how alike both halves of its way are in difference and in shade, 0..1"""
    contrast: float
    """median difference within it, in least ones"""
    contour_px: NDArray[np.int32]
    """(n, 1, 2) its outline"""

    @property
    def likeness(self) -> float:
        """How far it is round, in this image rather than in the background, and more than a shadow, 0..1."""
        return self.roundness * self.new * self.lit

    @property
    def lit(self) -> float:
        """How far it is more than a shadow, 1 - SHADE_PART to 1."""
        return 1 - SHADE_PART * self.shade

    def is_mixed(self, radius_px: float) -> bool:
        """Whether it may be a ball of about ``radius_px`` with its string, its shadow or a hand."""
        is_round = self.roundness >= (ROUND if self.even >= UNEVEN else ROUND_UNEVEN)
        return not is_round and not self.may_be_streak(radius_px)

    def may_be_streak(self, radius_px: float) -> bool:
        """Whether its shape is a moved disc's of about ``radius_px``: a ball with its string or shadow has another."""
        sized = abs(float(np.log2(self.width_px / (2 * radius_px)))) < STREAK_OCTAVES
        long = float(np.hypot(*self.way_px)) >= LONG * self.width_px
        return sized and long and self.filled >= FILLED and self.even >= EVEN

    def moved(self, right_px: int, down_px: int) -> Blob:
        """The blob in coordinates whose origin lies so far to the left and above."""
        way = np.array([right_px, down_px])
        return dataclasses.replace(self, centre_px=self.centre_px + way, contour_px=self.contour_px + way)

    def scaled(self, factor: float) -> Blob:
        """The blob in an image that is ``factor`` times as large."""
        return dataclasses.replace(
            self,
            centre_px=(self.centre_px + 0.5) * factor - 0.5,
            radius_px=self.radius_px * factor,
            way_px=self.way_px * factor,
            width_px=self.width_px * factor,
            contour_px=np.rint(self.contour_px * factor).astype(np.int32),
        )


def blobs_of(change: ImageChange, radius_px: float, least_px: float = 0.0) -> list[Blob]:
    """The connected parts of a change, of at least the radius ``least_px``, were the ball's radius ``radius_px``."""
    return list(_blobs(change, change.amount > change.least, radius_px, STRING_PART, (least_px, np.inf)))


def parts_of(change: ImageChange, blob: Blob, radius_px: float, sizes_px: tuple[float, float]) -> list[Blob]:
    """What a blob of a change comes apart into, of radii from the first to the second of ``sizes_px``."""
    left, top, width, height = cv2.boundingRect(blob.contour_px)
    inside = np.zeros((height, width), dtype=np.uint8)
    cv2.drawContours(inside, [blob.contour_px], -1, 1, -1, offset=(-left, -top))
    part = change.part(slice(top, top + height), slice(left, left + width))
    amount, lighter, shadow = part.amount * inside, part.lighter(), _shadow(part.pixels, part.background)
    masks = [(amount > level * part.least, thin) for level, thin in PARTS]
    for level in SIDE_LEVELS:
        above = amount > level * part.least
        masks += [(above & kind, STRING_PART) for kind in (lighter, ~lighter, ~shadow)]
    return [one.moved(left, top) for mask, thin in masks for one in _blobs(part, mask, radius_px, thin, sizes_px)]


def _blobs(
    change: ImageChange, mask: NDArray[np.bool_], radius_px: float, thin: float, sizes_px: tuple[float, float]
) -> Iterator[Blob]:
    """The connected parts of a mask, without what is thinner than the part ``thin`` of the ball's diameter."""
    gap, side = (2 * round(part * radius_px) + 1 for part in (GAP_PART, thin))
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, _disc(gap))
    opened = cv2.morphologyEx(closed, cv2.MORPH_OPEN, _disc(max(3, side)))
    least, most = (np.pi * size**2 for size in sizes_px)
    for found in cv2.findContours(opened, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]:
        pixels = cv2.contourArea(found) + len(found) / 2 + 1  # Pick's theorem
        blob = _blob_of(np.asarray(found, dtype=np.int32), change) if least <= pixels <= most else None
        if blob is not None:
            yield blob


def _disc(side_px: int) -> Image:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side_px, side_px)), dtype=np.uint8)


def _slope(pixels: Image) -> NDArray[np.float32]:
    grey = cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY)
    return np.asarray(np.hypot(cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)), dtype=np.float32)


def _blob_of(contour: NDArray[np.int32], change: ImageChange) -> Blob | None:
    if len(contour) < 6 or float(cv2.contourArea(contour)) < 4:
        return None
    left, top, width, height = cv2.boundingRect(contour)
    box = slice(top, top + height), slice(left, left + width)
    inside = np.zeros((height, width), dtype=np.uint8)
    cv2.drawContours(inside, [contour], -1, 1, -1, offset=(-left, -top))
    amount = np.asarray(inside * change.amount[box], dtype=np.float64)
    usual = float(np.median(amount[inside > 0]))
    weight = np.minimum(amount, usual)
    total = float(weight.sum())
    if total <= 0:
        return None
    u = left + float(weight.sum(axis=0) @ np.arange(width)) / total
    v = top + float(weight.sum(axis=1) @ np.arange(height)) / total
    area = float(inside.sum())
    enclosing = float(cv2.minEnclosingCircle(contour)[1])
    rows, columns = contour[:, 0, 1] - top, contour[:, 0, 0] - left
    shown, behind = (np.ascontiguousarray(one[box]) for one in (change.pixels, change.background))
    here, before = (float(_slope(one)[rows, columns].sum()) for one in (shown, behind))
    new = here / (here + before) if here + before > 0 else 0.0
    roundness = area / (np.pi * (enclosing + 0.5) ** 2)
    shadow = _shadow(shown, behind)
    shade = float(shadow[inside > 0].mean())
    way, width_px = _capsule(contour)
    even = _evenness(amount, shadow, np.array([u - left, v - top]), way)
    filled = area / max(np.pi * width_px**2 / 4 + width_px * float(np.hypot(*way)), 1.0)
    centre, radius = np.array([u, v]), float(np.sqrt(area / np.pi))
    roundness, filled = float(min(roundness, 1.0)), float(min(filled, 1.0))
    contrast = usual / change.least
    return Blob(centre, radius, roundness, change.least, new, shade, way, width_px, filled, even, contrast, contour)


def _evenness(
    amount: NDArray[np.float64], shadow: NDArray[np.bool_], middle: NDArray[np.float64], way: NDArray[np.float64]
) -> float:
    """How alike the two sides of ``middle`` along ``way`` are, 0..1, where the ``amount`` (h, w) is positive.

    The lesser of the mean amount of one side over the other's, and one less the difference of their parts in shadow.
    """
    rows, columns = np.nonzero(amount)
    ahead = (columns - middle[0]) * way[0] + (rows - middle[1]) * way[1] > 0
    if ahead.all() or not ahead.any():
        return 1.0
    values, shaded = amount[rows, columns], shadow[rows, columns]
    low, high = sorted((float(values[ahead].mean()), float(values[~ahead].mean())))
    return min(low / high, 1 - abs(float(shaded[ahead].mean()) - float(shaded[~ahead].mean())))


def _shadow(pixels: Image, background: Image) -> NDArray[np.bool_]:
    """Where (h, w) an image is darker than its background by the same factor in all colours, as a shadow is."""
    now, before = (cv2.blur(one, (3, 3)).astype(np.float32) for one in (pixels, background))
    factor = now / np.maximum(before, 1)
    low, high = factor.min(axis=2), factor.max(axis=2)
    tells = before.min(axis=2) > DARKEST
    return np.asarray(tells & (low > SHADOW[0]) & (high < SHADOW[1]) & (high - low < SAME_FACTOR))


def _capsule(contour: NDArray[np.int32]) -> tuple[NDArray[np.float64], float]:
    """The way (2,) of a disc that fills the narrowest rectangle about the contour as it moves, and its width."""
    corners = np.asarray(cv2.boxPoints(cv2.minAreaRect(contour)), dtype=np.float64)
    sides = corners[1] - corners[0], corners[2] - corners[1]
    long, short = sorted(sides, key=lambda side: -float(np.hypot(*side)))
    length, width = float(np.hypot(*long)), float(np.hypot(*short))
    way = long * ((length - width) / length) if length > 0 else np.zeros(2)
    return way, width + 1
