"""Colour of the ball: thresholds set by hand, or a table learned from labelled pixels."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import cv2
import numpy as np

from kendama_cli.schema.arrays import Array, set_arrays
from kendama_cli.vision.detection.interface import Image
from kendama_cli.vision.settings import ColourDetectorSettings

HUES, SATURATIONS = 30, 16
HUE_STEP, SATURATION_STEP = 180 // HUES, 256 // SATURATIONS
RARE = 1e-4
"""A colour that was seen nowhere is taken to make up so much of ball and surroundings alike."""
DARK_PART = 0.25
"""What is darker than this part of the darkest ball pixels has no colour to speak of."""


class ColourModel(Protocol):
    """Model of the pixels that may be the ball's."""

    def mask(self, pixels: Image) -> Image:
        """255 where ``pixels`` (h, w, 3) blue, green, red have the ball's colour, 0 elsewhere."""


class HsvThresholds:
    """A range of hue, least saturation and value."""

    def __init__(self, settings: ColourDetectorSettings) -> None:
        self._settings = settings

    def mask(self, pixels: Image) -> Image:
        """255 within the range, which may run through red (179 -> 0)."""
        s = self._settings
        hsv = cv2.cvtColor(pixels, cv2.COLOR_BGR2HSV)
        if s.hue_low <= s.hue_high:
            return _bytes(cv2.inRange(hsv, (s.hue_low, s.saturation_min, s.value_min), (s.hue_high, 255, 255)))
        high = cv2.inRange(hsv, (s.hue_low, s.saturation_min, s.value_min), (179, 255, 255))
        low = cv2.inRange(hsv, (0, s.saturation_min, s.value_min), (s.hue_high, 255, 255))
        return _bytes(cv2.bitwise_or(high, low))


@dataclass(frozen=True)
class LearnedColour:
    """The log odds (hues, saturations) of the ball against its surroundings, and the least value that counts.

    Hue and saturation do not change with the light's strength, nor with shading and gamma, so that one table serves
    the ball's bright and its dark side.
    """

    log_odds: Array
    value_min: int

    def __post_init__(self) -> None:
        set_arrays(self, log_odds=(HUES, SATURATIONS))

    @cached_property
    def _table(self) -> Image:
        """Every pair of hue and saturation, as one row of bytes that a 16-bit index looks up."""
        fine = np.repeat(np.repeat(self.log_odds > 0, HUE_STEP, axis=0), SATURATION_STEP, axis=1)
        return np.where(fine, 255, 0).astype(np.uint8).ravel()

    def mask(self, pixels: Image) -> Image:
        """255 where the ball is the likelier."""
        hsv = cv2.cvtColor(pixels, cv2.COLOR_BGR2HSV)
        index = hsv[..., 0].astype(np.uint16) * np.uint16(256) + hsv[..., 1]
        found = self._table[index]
        found[hsv[..., 2] < self.value_min] = 0
        return _bytes(found)

    def to_json(self) -> str:
        """Return the model as text; ``from_json`` takes it up again, exact to the last bit."""
        return json.dumps({"value_min": self.value_min, "log_odds": self.log_odds.tolist()})

    @staticmethod
    def from_json(text: str) -> LearnedColour:
        """Raises ValueError for a text that holds no such model."""
        try:
            data = json.loads(text)
            return LearnedColour(np.array(data["log_odds"], dtype=np.float64), int(data["value_min"]))
        except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as wrong:
            raise ValueError(f"no colour model of {HUES} x {SATURATIONS} log odds ({wrong})") from None


def learn_colour(ball: Image, around: Image) -> LearnedColour:
    """Learn the ball's colour from pixels of the ball (n, 3) and of everything else (m, 3), blue, green, red.

    Bayes' rule on histograms of hue and saturation, blurred by one bin (hue goes round). Raises ValueError without
    pixels of both kinds, and for a ball without a colour of its own: fewer than half of its pixels would be known.
    """
    if len(ball) == 0 or len(around) == 0:
        raise ValueError(f"{len(ball)} pixels of the ball and {len(around)} of what is around it; give some of both")
    hsv = _hsv(ball)
    value_min = max(1, int(DARK_PART * float(np.quantile(hsv[:, 2], 0.1))))
    odds = np.log(_histogram(hsv) + RARE) - np.log(_histogram(_hsv(around)) + RARE)
    model = LearnedColour(odds, value_min)
    known = float((model.mask(ball[None]) > 0).mean())
    if known < 0.5:
        raise ValueError(f"only {known:.0%} of the ball's pixels differ in colour from what is around it")
    return model


def learn_from_clicks(images: Sequence[Image], clicks: Sequence[Sequence[float]], radius_px: float) -> LearnedColour:
    """Learn from one click (u, v) on the ball per image, with the ball's radius; what lies two radii off is not ball.

    Only the inner part of the disc is used, for blur mixes its rim with the surroundings.
    """
    ball, around = [], []
    for image, (u, v) in zip(images, clicks, strict=True):
        rows, columns = np.mgrid[: image.shape[0], : image.shape[1]]
        distance = np.hypot(columns - u, rows - v)
        ball.append(image[distance <= 0.7 * radius_px])
        around.append(image[distance >= 2 * radius_px])
    return learn_colour(np.concatenate(ball), np.concatenate(around))


def _hsv(pixels: Image) -> Image:
    return _bytes(cv2.cvtColor(np.ascontiguousarray(pixels)[None], cv2.COLOR_BGR2HSV)[0])


def _histogram(hsv: Image) -> Array:
    counts = np.zeros((HUES, SATURATIONS))
    np.add.at(counts, (hsv[:, 0] // HUE_STEP, hsv[:, 1] // SATURATION_STEP), 1.0)
    counts = (np.roll(counts, 1, axis=0) + 2 * counts + np.roll(counts, -1, axis=0)) / 4
    wide = np.pad(counts, ((0, 0), (1, 1)), mode="edge")
    counts = (wide[:, :-2] + 2 * wide[:, 1:-1] + wide[:, 2:]) / 4
    return np.asarray(counts / counts.sum())


def _bytes(image: object) -> Image:
    return np.asarray(image, dtype=np.uint8)
