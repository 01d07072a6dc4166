"""Patches of training images: those that show the ball, with varied copies of them, and those that do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.patches import BALL_PX, COUNT, Features, patch_features, scaled
from kendama_cli.vision.detection.interface import Image

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
    """Scale the crop (h, w, 3) about ``middle_px`` (column, row); return it, its ball-free mask (h, w), and the
    factor.

    ``free`` (h, w) is True where the crop shows no ball. What lies beyond the crop is mirrored in.
    """
    factor = float(rng.uniform(1 - ZOOM, 1 + ZOOM))
    u, v = middle_px
    way = np.array([[factor, 0, (1 - factor) * u], [0, factor, (1 - factor) * v]])
    size = crop.shape[1], crop.shape[0]
    made = np.asarray(cv2.warpAffine(crop, way, size, borderMode=cv2.BORDER_REFLECT_101), dtype=np.uint8)
    shows_none = cv2.warpAffine(free.astype(np.uint8), way, size, flags=cv2.INTER_NEAREST, borderValue=0)
    return made, np.asarray(shows_none, dtype=np.bool_), factor


def varied(crop: Image, rng: np.random.Generator) -> Image:
    """Vary the crop: other light, and mostly blurred along a line."""
    values = crop.astype(np.float32)
    if rng.random() < BLURRED:
        values = np.asarray(cv2.filter2D(values, -1, _any_line(rng)), dtype=np.float32)
    return _lit(values, rng)


def before(background: Image, crop: Image, half_boxes: NDArray[np.float64], rng: np.random.Generator) -> Image:
    """Put the ball of the ``crop`` before a ``background`` of the same shape, mostly blurred by its own motion.

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
    """Return a kernel that blurs along a line."""
    half = int(np.ceil(length_px / 2))
    kernel = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
    for way in np.linspace(-length_px / 2, length_px / 2, 8 * half + 4):
        kernel[round(half + way * np.sin(angle_rad)), round(half + way * np.cos(angle_rad))] += 1
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)


SCALES = (0.75, 1.0, 1.33)
"""The ball is searched at its trained radius times these."""
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


def all_patches(images: Sequence[TrainedImage], rng: np.random.Generator) -> list[Patches]:
    """Return the patches of each of ``images`` at each of the SCALES."""
    radius_px = median_radius_px(images)
    most_px = MOST_PATCHES * (radius_px * min(SCALES) / BALL_PX) ** 2
    images = [_part(image, most_px, rng) for image in images]
    found: list[Patches] = []
    for scale in SCALES:
        views = [_view(number, image, BALL_PX / (radius_px * scale)) for number, image in enumerate(images)]
        found += [_collect(view, views, rng) for view in views]
    return found


def _part(image: TrainedImage, most_px: float, rng: np.random.Generator) -> TrainedImage:
    """Cut a rectangle with all boxes, of the image's shape and ``most_px`` pixels if they allow it; all if smaller."""
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
    return TrainedImage(image.pixels[top : top + height, left : left + width], boxes)


def median_radius_px(images: Sequence[TrainedImage]) -> float:
    """Return the median radius of the balls in the boxes."""
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


def _view(number: int, image: TrainedImage, scale: float) -> _View:
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
    """Collect the patches of one image at one scale; ``views`` are all images at that scale."""
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
    """Sample a part (height, width, 3) of one of the images that shows no ball; None if none is found."""
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
