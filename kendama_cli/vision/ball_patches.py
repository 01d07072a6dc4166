"""Patches of taught images: those that show the ball, with varied copies of them, and those that do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.ball_box import BallBox, TaughtImage
from kendama_cli.vision.ball_copies import before, varied, zoomed
from kendama_cli.vision.interface import Image
from kendama_cli.vision.patch_features import BALL_PX, COUNT, Features, patch_features, scaled

SCALES = (0.75, 1.0, 1.33)
"""The ball is searched at its taught radius times these."""
INSIDE, OUTSIDE = 0.35, 1.1
"""In half boxes: patches nearer to the box's middle show the ball, patches farther do not, the rest is left out."""
LIKE_RADIUS = (0.8, 1.25)
"""An image teaches the ball at a scale where its radius comes within this part of BALL_PX."""
VARIED = 12
"""Blurred, zoomed and otherwise lit copies of each ball."""
ELSEWHERE = 12
"""Copies of each ball before what else the images show: with few boxes its own backgrounds would be learned with it."""
COPY_RADII = 7.5
"""A copy reaches so many radii beyond the ball's places."""
TRIES = 10
OTHERS_AN_IMAGE, OTHERS_A_COPY = 1500, 60
MOST_PATCHES = 1_500_000
"""Of an image that shows more places to look at than this at the finest of SCALES, a part about its boxes teaches."""


@dataclass(frozen=True)
class Patches:
    """Features of patches in one image at one scale: those that show the ball as it is (``uncopied``) and with its
    copies, some others, and all that do not."""

    image: int
    uncopied: tuple[Features, ...]
    balls: tuple[Features, ...]
    others: tuple[Features, ...]
    elsewhere: Features


def all_patches(images: Sequence[TaughtImage], rng: np.random.Generator) -> list[Patches]:
    """The patches of each of ``images`` at each of the SCALES."""
    radius_px = median_radius_px(images)
    most_px = MOST_PATCHES * (radius_px * min(SCALES) / BALL_PX) ** 2
    images = [_part(image, most_px, rng) for image in images]
    found: list[Patches] = []
    for scale in SCALES:
        views = [_view(number, image, BALL_PX / (radius_px * scale)) for number, image in enumerate(images)]
        found += [_collect(view, views, rng) for view in views]
    return found


def _part(image: TaughtImage, most_px: float, rng: np.random.Generator) -> TaughtImage:
    """A rectangle of the image with all of its boxes, of the image's shape and ``most_px`` pixels where the boxes allow
    it; the image itself where it has no more."""
    size = np.array(image.pixels.shape[1::-1])
    smaller = np.ceil(size * min(np.sqrt(most_px / size.prod()), 1.0)).astype(int)
    if (smaller >= size).all():
        return image
    sides = np.array([(one.u_px, one.v_px, one.width_px, one.height_px) for one in image.boxes]).reshape(-1, 4)
    low = np.clip(np.floor((sides[:, :2] - sides[:, 2:]).min(axis=0, initial=size.max())).astype(int), 0, size)
    high = np.clip(np.ceil((sides[:, :2] + sides[:, 2:]).max(axis=0, initial=0)).astype(int), 0, size)
    smaller = np.minimum(np.maximum(smaller, high - low), size)
    first = rng.integers(np.maximum(high - smaller, 0), np.minimum(low, size - smaller) + 1)
    left, top = first.tolist()
    width, height = smaller.tolist()
    boxes = tuple(replace(one, u_px=one.u_px - left, v_px=one.v_px - top) for one in image.boxes)
    return TaughtImage(image.pixels[top : top + height, left : left + width], boxes)


def median_radius_px(images: Sequence[TaughtImage]) -> float:
    """Of the balls in the boxes."""
    return float(np.median([box.radius_px for image in images for box in image.boxes]))


@dataclass(frozen=True)
class _ViewedBall:
    """A box in a scaled image: its ball's radius [px], its middle (column, row), and every pixel's distance from the
    middle in half boxes."""

    radius_px: float
    middle_px: tuple[float, float]
    distance: NDArray[np.float64]


@dataclass(frozen=True)
class _View:
    """One image at one scale."""

    number: int
    pixels: Image
    balls: tuple[_ViewedBall, ...]
    outside: NDArray[np.bool_]
    """what shows no ball"""


def _view(number: int, image: TaughtImage, scale: float) -> _View:
    small = scaled(image.pixels, scale)
    rows, columns = np.mgrid[: small.shape[0], : small.shape[1]].astype(np.float64)
    balls = tuple(_viewed(columns, rows, box, scale) for box in image.boxes)
    away = [ball.distance for ball in balls]
    outside = np.min(away, axis=0) > OUTSIDE if away else np.ones(small.shape[:2], dtype=np.bool_)
    return _View(number, small, balls, outside)


def _viewed(columns: NDArray[np.float64], rows: NDArray[np.float64], box: BallBox, scale: float) -> _ViewedBall:
    u, v = (box.u_px + 0.5) * scale - 0.5, (box.v_px + 0.5) * scale - 0.5
    away = np.hypot((columns - u) / (box.width_px * scale / 2), (rows - v) / (box.height_px * scale / 2))
    return _ViewedBall(box.radius_px * scale, (u, v), away)


def _collect(view: _View, views: Sequence[_View], rng: np.random.Generator) -> Patches:
    """The patches of one image at one scale; ``views`` are all images at that scale."""
    features, outside = patch_features(view.pixels), view.outside
    uncopied: list[Features] = []
    balls: list[Features] = []
    others: list[Features] = []
    for ball in view.balls:
        inside = ball.distance < INSIDE
        if inside.any() and LIKE_RADIUS[0] < ball.radius_px / BALL_PX < LIKE_RADIUS[1]:
            uncopied.append(features[inside])
            copies, beside = _copies(view, ball, views, rng)
            balls += [uncopied[-1], copies]
            others.append(beside)
    places = np.argwhere(outside)
    if len(places):
        some = places[rng.integers(0, len(places), OTHERS_AN_IMAGE)]
        others.append(features[some[:, 0], some[:, 1]])
    elsewhere = features[::2, ::2][outside[::2, ::2]]
    return Patches(view.number, tuple(uncopied), tuple(balls), tuple(others), elsewhere)


def _copies(
    view: _View, ball: _ViewedBall, views: Sequence[_View], rng: np.random.Generator
) -> tuple[Features, Features]:
    """Features of a ball's places, and of some places about them, in varied copies of the image about the ball."""
    reach, inside = round(COPY_RADII * BALL_PX), np.argwhere(ball.distance < INSIDE)
    (top, left), (bottom, right) = np.maximum(inside.min(axis=0) - reach, 0), inside.max(axis=0) + reach
    part = slice(top, bottom), slice(left, right)
    middle = ball.middle_px[0] - left, ball.middle_px[1] - top
    empty = np.empty((0, COUNT), dtype=np.float32)
    balls, others = [empty], [empty]
    for number in range(VARIED + ELSEWHERE):
        crop, free, factor = zoomed(view.pixels[part], view.outside[part], middle, rng)
        near = ball.distance[part] / factor
        background = _background(views, near.shape[0], near.shape[1], rng) if number >= VARIED else None
        if background is None:
            copy = varied(crop, rng)
        else:
            copy, free = before(background, crop, near, rng), near > OUTSIDE
        features, places = patch_features(copy), np.argwhere(free)
        balls.append(features[near < INSIDE])
        if len(places):
            some = places[rng.integers(0, len(places), OTHERS_A_COPY)]
            others.append(features[some[:, 0], some[:, 1]])
    return np.concatenate(balls), np.concatenate(others)


def _background(views: Sequence[_View], height: int, width: int, rng: np.random.Generator) -> Image | None:
    """A part (height, width, 3) of one of the images that shows no ball; None where none is found."""
    for _ in range(TRIES):
        view = views[int(rng.integers(len(views)))]
        down, right = view.outside.shape[0] - height, view.outside.shape[1] - width
        if min(down, right) < 0:
            continue
        row, column = int(rng.integers(down + 1)), int(rng.integers(right + 1))
        part = slice(row, row + height), slice(column, column + width)
        if view.outside[part].all():
            return view.pixels[part]
    return None
