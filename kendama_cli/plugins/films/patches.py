"""Features of a patch at the scale of the ball (colour, lightness, texture), and a small classifier of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.vision.detection.interface import Image

Features = NDArray[np.float32]

BALL_PX = 6.0
"""Images are scaled so that the ball has this radius: the sizes below are in those pixels."""
REACH_PX = 18
"""No feature looks farther than this from its patch's middle."""
STRIP_PX = 512
"""Images are worked through in strips of so many rows: the features of a patch take 320 bytes."""
BOXES_PX = (3, 9, 17, 33)
RINGS_PX = (3.5, 10.0)
DIRECTIONS = 8
SPREADS_PX = (9, 17)
EDGES_PX = (3, 13)

FIXED = 3 * len(BOXES_PX)
RINGS = 3 * DIRECTIONS * len(RINGS_PX)
COUNT = FIXED + RINGS + 3 * len(SPREADS_PX) + len(EDGES_PX)
Values = NDArray[np.float32]
HIDDEN = (48, 16)
LEAK = np.float32(0.01)
CLIPPED = 4.0
"""Standardised inputs beyond this come from what was never shown: they count as this."""
FIRST_RATE, LAST_RATE = 3e-3, 1e-4
DECAY = 1e-4
MOMENT, SQUARE = 0.9, 0.999


def scaled(pixels: Image, scale: float) -> Image:
    """Resize the image by ``scale``; a pixel's centre u comes to scale (u + 0.5) - 0.5."""
    height, width = pixels.shape[:2]
    size = max(round(width * scale), 1), max(round(height * scale), 1)
    way = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(pixels, size, interpolation=way), dtype=np.uint8)


def patch_features(pixels: Image, every: int = 1) -> Features:
    """Features (h, w, COUNT) of the patch about every ``every``-th pixel of ``pixels`` (blue, green, red).

    In CIE Lab: means over boxes, means of 3 x 3 at eight places on two rings (the inner one on the ball, the outer one
    about it), standard deviations, and the mean gradient of the lightness. Beyond the border the image is mirrored.
    """
    lab = cv2.cvtColor(pixels.astype(np.float32) / np.float32(255), cv2.COLOR_BGR2LAB)
    height, width = lab.shape[:2]
    border = (REACH_PX,) * 4
    wide = np.asarray(cv2.copyMakeBorder(lab, *border, cv2.BORDER_REFLECT_101), dtype=np.float32)
    rows, columns = -(-height // every), -(-width // every)
    made = np.empty((COUNT, rows, columns), dtype=np.float32)
    column = 0

    def add(values: NDArray[np.float32], right: int = 0, down: int = 0) -> None:
        nonlocal column
        top, left = REACH_PX + down, REACH_PX + right
        part = values[top : top + height : every, left : left + width : every]
        depth = 1 if part.ndim == 2 else part.shape[2]
        made[column : column + depth] = part.reshape(rows, columns, depth).transpose(2, 0, 1)
        column += depth

    means = {side: _mean(wide, side) for side in BOXES_PX}
    for side in BOXES_PX:
        add(means[side])
    for radius in RINGS_PX:
        for angle in 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
            add(means[3], round(radius * np.cos(angle)), round(radius * np.sin(angle)))
    squares = wide * wide
    for side in SPREADS_PX:
        add(np.sqrt(np.maximum(_mean(squares, side) - means[side] ** 2, 0)))
    light = np.ascontiguousarray(wide[..., 0])
    slope = np.hypot(cv2.Sobel(light, cv2.CV_32F, 1, 0), cv2.Sobel(light, cv2.CV_32F, 0, 1))
    for side in EDGES_PX:
        add(_mean(slope, side))
    return made.transpose(1, 2, 0)  # in memory a feature of all patches lies together: it is written in one go


def feature_strips(pixels: Image, every: int) -> Iterator[Features]:
    """Yield patch_features of ``pixels`` and ``every``, a divisor of STRIP_PX, in parts (rows, w, COUNT) downwards."""
    margin = -(-REACH_PX // every) * every
    for top in range(0, len(pixels), STRIP_PX):
        low, bottom = max(top - margin, 0), min(top + STRIP_PX, len(pixels))
        first = (top - low) // every
        yield patch_features(pixels[low : bottom + margin], every)[first : first - (top - bottom) // every]


def turned(steps: int, *, mirrored: bool) -> NDArray[np.intp]:
    """Return the order of features (COUNT,) of a patch rotated by ``steps`` eighths, and mirrored before."""
    order = list(range(FIXED))
    for ring in range(len(RINGS_PX)):
        first = FIXED + 3 * DIRECTIONS * ring
        for place in range(DIRECTIONS):
            source = (steps + (-place if mirrored else place)) % DIRECTIONS
            order += [first + 3 * source + channel for channel in range(3)]
    return np.array([*order, *range(FIXED + RINGS, COUNT)], dtype=np.intp)


def _mean(values: NDArray[np.float32], side: int) -> NDArray[np.float32]:
    return np.asarray(cv2.blur(values, (side, side)), dtype=np.float32)


@dataclass(frozen=True)
class PatchClassifier:
    """log odds = W3 h(W2 h(W1 z + b1) + b2) + b3, with z the standardised features and h a leaky rectifier."""

    mean: Values
    """(features,)"""
    spread: Values
    """(features,) standard deviations"""
    weights: tuple[Values, ...]
    biases: tuple[Values, ...]

    def log_odds(self, features: Values) -> Values:
        """Return the log odds (n,) that patches with these ``features`` (n, features) show the ball."""
        values = standardised(features, self.mean, self.spread)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = values @ weight
            values += bias
            np.maximum(values, LEAK * values, out=values)
        return np.asarray((values @ self.weights[-1] + self.biases[-1])[:, 0], dtype=np.float32)


def standardised(features: Values, mean: Values, spread: Values) -> Values:
    """(features - mean) / spread, clipped."""
    values = features - mean
    values /= spread
    return np.asarray(np.clip(values, -CLIPPED, CLIPPED, out=values), dtype=np.float32)


class Training:
    """The classifier while it learns: Adam (Kingma and Ba 2015) on the cross-entropy, with weight decay."""

    def __init__(self, mean: Values, spread: Values, steps: int, rng: np.random.Generator) -> None:
        sizes = (len(mean), *HIDDEN, 1)
        self._mean, self._spread, self._steps, self._step = mean, spread, steps, 0
        self._weights = [rng.normal(0, np.sqrt(2 / a), (a, b)).astype(np.float32) for a, b in pairwise(sizes)]
        self._biases = [np.zeros(b, dtype=np.float32) for b in sizes[1:]]
        parts = self._weights + self._biases
        self._moments = [np.zeros_like(part) for part in parts]
        self._squares = [np.zeros_like(part) for part in parts]

    def learn(self, inputs: Values, is_ball: Values) -> None:
        """Step once on a batch of standardised inputs (n, features) and their truths (n,), 0 or 1."""
        layers = [inputs]
        for weight, bias in zip(self._weights[:-1], self._biases[:-1], strict=True):
            sums = layers[-1] @ weight + bias
            layers.append(np.maximum(sums, LEAK * sums))
        log_odds = (layers[-1] @ self._weights[-1] + self._biases[-1])[:, 0]
        back = ((1 / (1 + np.exp(-np.clip(log_odds, -30, 30))) - is_ball) / np.float32(len(is_ball)))[:, None]
        slopes: list[Values] = []
        bias_slopes: list[Values] = []
        for number in reversed(range(len(self._weights))):
            slopes.insert(0, layers[number].T @ back + np.float32(DECAY) * self._weights[number])
            bias_slopes.insert(0, back.sum(axis=0))
            if number:
                back = (back @ self._weights[number].T) * np.where(layers[number] > 0, np.float32(1), LEAK)
        self._descend(slopes + bias_slopes)

    def _descend(self, slopes: Sequence[Values]) -> None:
        rate = FIRST_RATE * (1 - self._step / self._steps) + LAST_RATE
        self._step += 1
        parts = self._weights + self._biases
        for part, slope, mean, square in zip(parts, slopes, self._moments, self._squares, strict=True):
            np.add(MOMENT * mean, (1 - MOMENT) * slope, out=mean, casting="same_kind")
            np.add(SQUARE * square, (1 - SQUARE) * slope * slope, out=square, casting="same_kind")
            size = np.sqrt(square / (1 - SQUARE**self._step)) + 1e-8
            np.subtract(part, rate * mean / (1 - MOMENT**self._step) / size, out=part, casting="same_kind")

    def classifier(self) -> PatchClassifier:
        """Return the classifier learned so far."""
        copies = [[part.copy() for part in parts] for parts in (self._weights, self._biases)]
        return PatchClassifier(self._mean, self._spread, tuple(copies[0]), tuple(copies[1]))
