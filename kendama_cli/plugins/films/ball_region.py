"""Region of a ball in a film's images, by its colours: region competition (Zhu and Yuille 1996).

A classifier of patches says where about a ball is; half of a ball of two colours looks as good to it as the whole. A
pixel belongs to the ball where its colour is likelier the ball's than that of what is about the ball in the same image.
Neither is known beforehand: disc and colours are found in turn, over many images at once, for the ball is the same in
all of them and what is behind it is not.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.plugins.films.ball_box import TrainedImage
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Image, Sighting

PATCH_RADIUS_PX = 10.0
"""Patches are scaled so that the ball as it was seen has this radius."""
HALF_PX = 40
"""A patch has so many pixels to either side of its middle."""
BINS = 20
"""Steps of each of L, a and b."""
CHROMA = 48.0
"""a and b beyond this count as this."""
NEIGHBOUR = 0.107
"""A colour counts by this part for each neighbouring bin: a normal distribution of half a bin."""
RAREST = 2e-4
"""Added to each share: what was never seen says little."""
MOST_LOG_ODDS = 2.0
TAUGHT = 0.3
"""Weight of the boxes' colours beside those that the film shows: its images are few, but surely of the ball."""
COMMON = 0.2
"""Weight of what is about the ball in all images beside what is about it in this one."""
INSIDE, OUTSIDE, FARTHEST = 0.95, 1.2, 3.0
"""In radii: what is taken for the ball's colours, and what for its surroundings' (FARTHEST in radii as seen)."""
FIRST_OUTSIDE = 1.6
PULL = 0.5
"""Log odds that a pixel loses, on average over the disc, one radius from the usual place."""
REACH = 0.7
SIZES = (0.74, 1.36)
"""The ball is so large, in radii as seen."""
SIZE_STEPS = (0.92, 1.0, 1.08)
RADII = np.geomspace(0.7, 1.43, 21)
"""In one image the ball is so large, in radii of the film."""
UNUSUAL = 0.3
"""Log odds that each pixel of the ball loses for ball e times as large as usual, squared."""
LEAST_ODDS = 0.5
"""With lower mean log odds of the ball's pixels its colours do not tell it from what is about it."""
LEAST_SHARE = 0.5
"""A sighting whose pixels have less than this part of the usual log odds loses score in proportion."""
ROUNDS = 6
MOST_IMAGES = 40
SIGMA_RADII = 0.07
"""Standard deviation of a placed centre along each axis, in ball radii: measured on composed films."""

_ROWS, _COLUMNS = np.mgrid[-HALF_PX : HALF_PX + 1, -HALF_PX : HALF_PX + 1].astype(np.float64)

Bins = NDArray[np.uint16]
"""A patch of each frame is kept: 13 kB."""


@dataclass(frozen=True)
class BallRegion:
    """The ball's colours and those about it, and how far its middle is from where the detector sees it."""

    seen_px: float
    """the radius that has PATCH_RADIUS_PX in a patch [px]"""
    inside: Array
    """(BINS^3,) share of each colour on the ball"""
    outside: Array
    """(BINS^3,) and about it, over all images"""
    radius: float
    """the ball's radius in the film, in pixels of a patch"""
    offset: Array
    """(2,) the ball's middle from the sighting's, in pixels of a patch"""
    odds: float
    """a pixel's mean log odds within the ball's disc"""

    def placed(self, sighting: Sighting, colours: Bins) -> Sighting:
        """Move ``sighting`` to the disc that the ball's colours fill in the patch about it; a poor fill scores less."""
        middle, radius = self.offset, self.radius
        for _ in range(2):
            odds = _log_odds(colours, self.inside, self._about(colours, middle, radius))
            middle = _shifted(odds, self.offset, radius, self.offset)
            radius = _radius(odds, middle, self.radius)
        unit = self.seen_px / PATCH_RADIUS_PX
        trusted = _mean(odds, middle, radius) / (LEAST_SHARE * self.odds)
        return dataclasses.replace(
            sighting,
            score=sighting.score * min(max(trusted, 0.0), 1.0),
            centre_px=sighting.centre_px + middle * unit,
            covariance_px2=np.eye(2) * (SIGMA_RADII * radius * unit) ** 2,
            radius_px=radius * unit,
        )

    def _about(self, colours: Bins, middle: Array, radius: float) -> Array:
        away = _away(middle)
        return _mixed(_shares(colours[(away > OUTSIDE * radius) & _near(away)]), self.outside, COMMON)


def placed(
    seen: Mapping[int, Sighting], frames: Iterable[Image], images: Sequence[TrainedImage]
) -> dict[int, Sighting]:
    """Move what is ``seen`` in a film's ``frames``, by their number, to the disc that the ball's colours fill.

    ``images`` taught the ball by boxes. Nothing is moved if the ball's colours are those about it.
    """
    if not seen:
        return {}
    seen_px = float(np.median([one.radius_px for one in seen.values()]))
    patches = {
        number: _colours(pixels, seen[number].centre_px, seen_px)
        for number, pixels in enumerate(frames)
        if number in seen
    }
    region = learn_region(images, list(patches.values()), seen_px)
    if region is None:
        return dict(seen)
    return {number: region.placed(seen[number], colours) for number, colours in patches.items()}


def learn_region(images: Sequence[TrainedImage], seen: Sequence[Bins], seen_px: float) -> BallRegion | None:
    """Learn the ball's region from the boxes of ``images`` and the patches ``seen`` in a film.

    Each of ``seen`` has the ball's centre to within a radius and its radius, ``seen_px``, to within a third. None if
    the ball's colours are those about it.
    """
    boxed = np.mean([_boxed(image, number) for image in images for number in range(len(image.boxes))], axis=0)
    patches = seen[:: -(-len(seen) // MOST_IMAGES)]
    middles, radius, inside = [np.zeros(2) for _ in patches], PATCH_RADIUS_PX, boxed
    for number in range(ROUNDS):
        away = [_away(middle) for middle in middles]
        if number:
            own = np.mean([_shares(one[far < INSIDE * radius]) for one, far in zip(patches, away, strict=True)], axis=0)
            inside = _mixed(own, boxed, TAUGHT)
        least = (OUTSIDE if number else FIRST_OUTSIDE) * radius
        about = [_shares(one[(far > least) & _near(far)]) for one, far in zip(patches, away, strict=True)]
        outside = np.mean(about, axis=0)
        odds = [_log_odds(one, inside, _mixed(own, outside, COMMON)) for one, own in zip(patches, about, strict=True)]
        if number < 2:  # what one image shows is ambiguous, all of them together are less so
            together = np.mean([_moved(one, middle) for one, middle in zip(odds, middles, strict=True)], axis=0)
            shift = _shifted(together, np.zeros(2), radius, None)
            middles = [middle + shift for middle in middles]
        if number:
            usual = np.median(middles, axis=0)
            middles = [_shifted(one, usual, radius, usual) for one in odds]
        if number >= 2:
            radius = _sized(odds, middles, radius)
    mean = float(np.median([_mean(one, middle, radius) for one, middle in zip(odds, middles, strict=True)]))
    if mean < LEAST_ODDS:
        return None
    return BallRegion(seen_px, inside, outside, radius, np.median(middles, axis=0), mean)


def _boxed(image: TrainedImage, number: int) -> Array:
    """Return the fractions of the colours within a box's ellipse."""
    box = image.boxes[number]
    colours = _colours(image.pixels, np.array([box.u_px, box.v_px]), box.radius_px)
    ellipse = np.hypot(_COLUMNS * box.radius_px / (box.width_px / 2), _ROWS * box.radius_px / (box.height_px / 2))
    return _shares(colours[ellipse < INSIDE * PATCH_RADIUS_PX])


def _colours(pixels: Image, centre_px: Array, radius_px: float) -> Bins:
    """Return the colours' bins (2 HALF_PX + 1, the same) about a centre (2,), scaled by the radius there."""
    scale = PATCH_RADIUS_PX / radius_px
    reach = int(np.ceil(HALF_PX / scale)) + 3
    left, top = (np.floor(centre_px).astype(int) - reach).tolist()
    height, width = pixels.shape[:2]
    columns, rows = np.clip([left, left + 2 * reach + 1], 0, width), np.clip([top, top + 2 * reach + 1], 0, height)
    part = pixels[rows[0] : max(rows[1], rows[0] + 1), columns[0] : max(columns[1], columns[0] + 1)]
    if scale < 0.8:
        part = np.asarray(cv2.GaussianBlur(part, (0, 0), 0.45 / scale), dtype=np.uint8)
    corner = np.asarray(centre_px) - (columns[0], rows[0])
    way = np.array([[scale, 0, HALF_PX - scale * corner[0]], [0, scale, HALF_PX - scale * corner[1]]])
    side = 2 * HALF_PX + 1
    patch = cv2.warpAffine(part, way, (side, side), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    smooth = cv2.GaussianBlur(patch, (0, 0), 0.7).astype(np.float32) / np.float32(255)
    lab = cv2.cvtColor(smooth, cv2.COLOR_BGR2LAB)
    parts = (lab - (0, -CHROMA, -CHROMA)) / (100, 2 * CHROMA, 2 * CHROMA)
    bins = np.clip((BINS * parts).astype(np.intp), 0, BINS - 1)
    return ((bins[..., 0] * BINS + bins[..., 1]) * BINS + bins[..., 2]).astype(np.uint16)


def _shares(colours: Bins) -> Array:
    """Return the fraction of each colour (BINS^3,), counted in the neighbouring bins too; zeros without pixels."""
    counts = np.bincount(colours.ravel(), minlength=BINS**3).astype(np.float64).reshape(BINS, BINS, BINS)
    for axis in range(3):
        wide = np.pad(counts, [(1, 1) if one == axis else (0, 0) for one in range(3)])
        before, after = np.take(wide, range(BINS), axis), np.take(wide, range(2, BINS + 2), axis)
        counts = (1 - 2 * NEIGHBOUR) * counts + NEIGHBOUR * (before + after)
    return np.asarray(counts.ravel() / max(float(counts.sum()), 1e-9), dtype=np.float64)


def _mixed(one: Array, other: Array, part: float) -> Array:
    return (1 - part) * one + part * other


def _log_odds(colours: Bins, inside: Array, about: Array) -> Array:
    """For each pixel of a patch, log of how much likelier its colour is on the ball than about it."""
    odds = np.clip(np.log((inside + RAREST) / (about + RAREST)), -MOST_LOG_ODDS, MOST_LOG_ODDS)
    return np.asarray(odds[colours], dtype=np.float64)


def _away(middle: Array) -> Array:
    return np.asarray(np.hypot(_COLUMNS - middle[0], _ROWS - middle[1]))


def _near(away: Array) -> NDArray[np.bool_]:
    return np.asarray(away < FARTHEST * PATCH_RADIUS_PX)


def _moved(odds: Array, middle: Array) -> Array:
    """Move the patch so that ``middle`` comes to its centre."""
    way = np.array([[1, 0, -middle[0]], [0, 1, -middle[1]]])
    return np.asarray(cv2.warpAffine(odds, way, odds.shape[::-1], borderMode=cv2.BORDER_REPLICATE), dtype=np.float64)


def _mean(odds: Array, middle: Array, radius: float) -> float:
    """Return a pixel's mean log odds within a disc."""
    return float(odds[_away(middle) < radius].mean())


def _shifted(odds: Array, start: Array, radius: float, usual: Array | None) -> Array:
    """Return the centre (2,) of the disc with the highest mean log odds, within REACH radii of ``start``."""
    half = int(radius) + 2
    rows, columns = np.mgrid[-half : half + 1, -half : half + 1]
    disc = np.clip(radius + 0.5 - np.hypot(rows, columns), 0, 1)
    means = np.asarray(cv2.filter2D(odds, -1, disc / disc.sum(), borderType=cv2.BORDER_CONSTANT))
    if usual is not None:
        means = means - PULL * (_away(usual) / PATCH_RADIUS_PX) ** 2
    means = np.where(_away(start) < REACH * PATCH_RADIUS_PX, means, -np.inf)
    row, column = np.unravel_index(int(means.argmax()), means.shape)
    place = np.array([_COLUMNS[row, column], _ROWS[row, column]])
    for axis, (low, high) in enumerate(
        ((means[row, column - 1], means[row, column + 1]), (means[row - 1, column], means[row + 1, column]))
    ):
        bend = low + high - 2 * means[row, column]
        if np.isfinite(bend) and bend < 0:
            place[axis] += np.clip((low - high) / (2 * bend), -0.5, 0.5)
    return place


def _sized(odds: Sequence[Array], middles: Sequence[Array], radius: float) -> float:
    """Return the radius of which the discs together have the most log odds, a step from ``radius`` at most."""

    def total(tried: float) -> float:
        return sum(
            float((one * np.clip(tried + 0.5 - _away(middle), 0, 1)).sum())
            for one, middle in zip(odds, middles, strict=True)
        )

    low, high = (size * PATCH_RADIUS_PX for size in SIZES)
    return max((radius * step for step in SIZE_STEPS if low <= radius * step <= high), key=total)


def _radius(odds: Array, middle: Array, usual: float) -> float:
    """Return the radius of which the disc about ``middle`` has the most log odds, less a loss far from the usual."""
    tried = usual * RADII
    away = _away(middle)
    reach = away < tried[-1] + 1
    inside = np.clip(tried[:, None] + 0.5 - away[reach], 0, 1)
    gained = inside @ odds[reach] - UNUSUAL * np.pi * usual**2 * np.log(RADII) ** 2
    best = int(gained.argmax())
    if not 0 < best < len(tried) - 1:
        return float(tried[best])
    low, top, high = gained[best - 1 : best + 2]
    return float(
        tried[best] * (RADII[1] / RADII[0]) ** np.clip((low - high) / min(2 * (low + high - 2 * top), -1e-9), -0.5, 0.5)
    )
