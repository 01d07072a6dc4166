"""Colour of the ball: thresholds set by hand, or a table learned from labelled pixels."""

from __future__ import annotations

import json
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


def _bytes(image: object) -> Image:
    return np.asarray(image, dtype=np.uint8)
