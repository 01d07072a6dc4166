"""Finding a ball that was taught: every patch of the image is asked how much it looks like it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.films.ball_patches import SCALES
from kendama_cli.plugins.films.patches import BALL_PX, COUNT, feature_strips, scaled
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.training import TrainedBall
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Image, SearchHint, Sighting

TEMPERATURE = 3.0
"""A classifier that has seen a few boxes is too sure: its log odds are divided by this."""
MOST_LOG_ODDS = 60.0
"""More is no surer, and products of odds stay finite."""
EVERY_PX = 2
"""Every second pixel of the scaled image is asked: a third of the ball's radius."""
SMOOTHED_PX = 1.0
SEARCHED_RADII = 4.0
"""Radii of the ball about the expected place within which it is searched, given a hint."""
SIGMA_RADII = 0.15
"""Standard deviation of a peak's place, in ball radii: measured on films that taught the detector with 5 boxes."""
LEAST_LOG_ODDS = -6.0
"""Weaker peaks are not worth a tracker's time."""
REMEDY = "teach the ball with 'kendama camera train'"


def peak_scores(log_odds: Array, balls: int) -> Array:
    """Probabilities (n,) that peaks with ``log_odds`` (n,) show a ball, where an image shows ``balls`` at most.

    Each peak by itself would show one with odds o_i = exp(log odds / TEMPERATURE). Of all sets S of peaks those of no
    more than ``balls`` are possible, each with a weight of prod_{i in S} o_i:

        p_i = o_i e(o without o_i, balls - 1) / e(o, balls),   e(o, m) = sum_{|S| <= m} prod_{i in S} o_i

    For one ball that is o_i / (1 + sum_j o_j); for as many balls as peaks, o_i / (1 + o_i). What resembles the ball and
    was not in the training images (a checked shirt) has many peaks, the ball has one.
    """
    odds = np.exp(np.minimum(log_odds, MOST_LOG_ODDS) / TEMPERATURE)
    possible = _sets(odds, balls)
    some = [odd * _sets(np.delete(odds, i), balls - 1) / possible for i, odd in enumerate(odds)]
    return np.array(some, dtype=np.float64)


def _sets(odds: Array, most: int) -> float:
    """e(odds, most): the sum of the elementary symmetric polynomials of degree 0 to ``most``."""
    by_size = np.zeros(most + 1)
    by_size[0] = 1
    for odd in odds:
        by_size[1:] += odd * by_size[:-1]
    return float(by_size.sum())


@dataclass(frozen=True)
class _Peak:
    """A place where the classifiers' log odds are highest."""

    centre_px: Array
    radius_px: float
    log_odds: float


class TrainedDetector:
    """Peaks of a classifier's log odds over place and scale, scored together (see peak_scores)."""

    def __init__(self, settings: TrainedDetectorSettings, ball: TrainedBall) -> None:
        self._candidates, self._balls, self.threshold = settings.candidates, settings.balls, settings.score_min
        self._ball = ball

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """See Detector: the highest score first; with a ``hint`` the nearest to it first, and only its surroundings."""
        corner = np.array(origin_px, dtype=np.float64)
        if hint is not None:
            half = SEARCHED_RADII * max(self._ball.radius_px, hint.radius_px)
            low = np.maximum(np.floor(hint.centre_px - corner - half), 0).astype(int)
            high = np.ceil(hint.centre_px - corner + half).astype(int) + 1
            pixels = pixels[low[1] : max(high[1], 0), low[0] : max(high[0], 0)]
            corner = corner + low
        kept: list[_Peak] = []
        for one in sorted(self._peaks(pixels), key=lambda one: -one.log_odds):
            if all(float(np.hypot(*(one.centre_px - other.centre_px))) > self._ball.radius_px for other in kept):
                kept.append(one)
        scores = peak_scores(np.array([one.log_odds for one in kept]), self._balls)
        found = [
            Sighting(
                one.centre_px + corner, np.eye(2) * (SIGMA_RADII * one.radius_px) ** 2, one.radius_px, float(score)
            )
            for one, score in zip(kept[: self._candidates], scores, strict=False)
        ]
        if hint is not None:
            expected = np.asarray(hint.centre_px)
            found.sort(key=lambda one: float(np.hypot(*(one.centre_px - expected))))
        yield from found

    def _peaks(self, pixels: Image) -> Iterator[_Peak]:
        """Yield the highest peaks at each scale, in the coordinates of ``pixels``."""
        if min(pixels.shape[:2]) < 2:
            return
        for scale in SCALES:
            radius_px = self._ball.radius_px * scale
            small = scaled(pixels, BALL_PX / radius_px)
            # sizes are whole pixels: in a small region that is another scale than was asked for
            shrink = np.array(small.shape[1::-1]) / pixels.shape[1::-1]
            strips = feature_strips(small, EVERY_PX)
            rough = np.concatenate(
                [self._ball.log_odds(one.reshape(-1, COUNT)).reshape(one.shape[:2]) for one in strips]
            )
            log_odds: Array = np.asarray(cv2.GaussianBlur(rough, (0, 0), SMOOTHED_PX), dtype=np.float64)
            for _ in range(self._candidates):
                row, column = divmod(int(log_odds.argmax()), log_odds.shape[1])
                highest = float(log_odds[row, column])
                if highest < LEAST_LOG_ODDS:
                    break
                centre = (EVERY_PX * _top(log_odds, row, column) + 0.5) / shrink - 0.5
                yield _Peak(centre, radius_px, highest)
                cv2.circle(log_odds, (column, row), round(BALL_PX / EVERY_PX) + 1, -50.0, -1)


def _top(values: Array, row: int, column: int) -> Array:
    """Column and row (2,) of the top of the parabolas through a peak and its neighbours."""
    place = np.array([column, row], dtype=np.float64)
    for axis, (before, after) in enumerate(
        (((row, column - 1), (row, column + 1)), ((row - 1, column), (row + 1, column)))
    ):
        if before[1 - axis] >= 0 and after[1 - axis] < values.shape[1 - axis]:
            low, middle, high = float(values[before]), float(values[row, column]), float(values[after])
            if low > -40 and high > -40 and low + high < 2 * middle:
                place[axis] += np.clip((low - high) / (2 * (low + high - 2 * middle)), -0.5, 0.5)
    return place


def trained_detector(settings: TrainedDetectorSettings) -> TrainedDetector:
    """Make the detector of the ball that ``settings`` name; raises InputError for a file that holds none."""
    try:
        ball = TrainedBall.from_bytes(Path(settings.ball).read_bytes())
    except OSError as wrong:
        raise InputError(settings.ball, f"cannot be read ({wrong.strerror})", remedy=REMEDY) from None
    except ValueError as wrong:
        raise InputError(settings.ball, str(wrong), remedy=REMEDY) from None
    return TrainedDetector(settings, ball)
