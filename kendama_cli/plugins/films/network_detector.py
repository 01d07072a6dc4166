"""Finding the ball with a neural network that gives a heat map or boxes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import StageError
from kendama_cli.plugins.films.settings import NetworkDetectorSettings
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Image, SearchHint, Sighting

LEAST_SCORE = 0.03
"""Weaker peaks are not worth a tracker's time."""
SIGMA_RADII = 0.15
"""Standard deviation of a sighting's place, in ball radii, as of a trained detector."""
GREY = 114
"""What is left of the input, as in the training of most networks of boxes."""
ROUNDING = 0.01
TOP_PART = 0.5
"""The middle of a peak is that of what is above this part of it, where the heat map is."""


class NetworkDetector:
    """Peaks of a heat map, or boxes; the score is the network's probability.

    The image is scaled, put into the upper left of the input, and goes in as red, green, blue from 0 to 1.
    """

    def __init__(self, settings: NetworkDetectorSettings, network: Any) -> None:
        self._settings, self._network = settings, network
        self.threshold = settings.score_min

    def fits(self, output: NDArray[np.float32]) -> bool:
        """Return True if an output of the network has the shape that the settings say."""
        number = self._settings.class_number
        if self._settings.output == "heatmap":
            return output.ndim == 4 and output.shape[0] == 1 and output.shape[1] > number and output.shape[2] > 1
        return output.ndim == 3 and output.shape[0] == 1 and min(output.shape[1:]) > 4 + number

    def output(self, pixels: Image) -> NDArray[np.float32]:
        """Run the network on ``pixels`` (h, w, 3), which must not be larger than its input."""
        width, height = self._settings.input_px
        put = np.full((height, width, 3), GREY, dtype=np.uint8)
        put[: pixels.shape[0], : pixels.shape[1]] = pixels
        self._network.setInput(cv2.dnn.blobFromImage(put, 1 / 255, swapRB=True))
        return np.nan_to_num(np.asarray(self._network.forward(), dtype=np.float32))

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """See Detector: the highest score first; with a ``hint`` the nearest to it first."""
        scale = self._settings.scale
        small = pixels
        if scale != 1.0:
            way = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
            small = np.asarray(cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=way), dtype=np.uint8)
        (height, width), (most_width, most_height) = small.shape[:2], self._settings.input_px
        if width > most_width or height > most_height:
            fitting = scale * min(most_width / width, most_height / height)
            raise StageError(
                f"an image of {pixels.shape[1]} x {pixels.shape[0]} px does not fit the network's input of "
                f"{most_width} x {most_height} px; predict.detector.scale={fitting:.3f} would make it fit"
            )
        output = self.output(small)[0]
        found = self._peaks(output, (height, width)) if output.ndim == 3 else self._boxes(output)
        kept: list[Sighting] = []
        for one in sorted(found, key=lambda sighting: -sighting.score):
            if all(float(np.hypot(*(one.centre_px - other.centre_px))) > one.radius_px for other in kept):
                kept.append(one)
        kept = kept[: self._settings.candidates]
        if hint is not None:
            expected = np.asarray(hint.centre_px) - origin_px
            kept.sort(key=lambda one: float(np.hypot(*(one.centre_px - expected))))
        for one in kept:
            yield Sighting(one.centre_px + origin_px, one.covariance_px2, one.radius_px, one.score)

    def _sighting(self, at: Array, radius_px: float, score: float) -> Sighting:
        """Return the detection at ``at`` (2,) in the input, in the image's own pixels."""
        centre = (at + 0.5) / self._settings.scale - 0.5
        return Sighting(centre, np.eye(2) * (SIGMA_RADII * radius_px) ** 2, radius_px, float(np.clip(score, 0, 1)))

    def _peaks(self, maps: NDArray[np.float32], size: tuple[int, int]) -> Iterator[Sighting]:
        """Yield the highest peaks of a heat map (classes, h, w), which may be coarser than the input."""
        heat = _probabilities(maps[self._settings.class_number]).copy()
        cell = np.array(self._settings.input_px) / (heat.shape[1], heat.shape[0])
        heat[int(np.ceil(size[0] / cell[1])) :] = 0
        heat[:, int(np.ceil(size[1] / cell[0])) :] = 0
        near = max(round(self._settings.radius_px * self._settings.scale / float(cell.max())), 1)
        for _ in range(self._settings.candidates):
            row, column = divmod(int(heat.argmax()), heat.shape[1])
            score = float(heat[row, column])
            if score < LEAST_SCORE:
                return
            top, left = max(row - near, 0), max(column - near, 0)
            part = heat[top : row + near + 1, left : column + near + 1]
            weight = np.maximum(part - TOP_PART * score, 0).astype(np.float64)
            v, u = np.indices(part.shape)
            middle = np.array([left + (weight * u).sum() / weight.sum(), top + (weight * v).sum() / weight.sum()])
            yield self._sighting((middle + 0.5) * cell - 0.5, self._settings.radius_px, score)
            part[:] = 0

    def _boxes(self, rows: NDArray[np.float32]) -> Iterator[Sighting]:
        """Rows (n, 4 + classes) or their transpose: middle, width, height [px of the input], probabilities."""
        rows = rows.T if rows.shape[0] < rows.shape[1] else rows
        scores = _probabilities(rows[:, 4 + self._settings.class_number])
        best = np.argsort(-scores, kind="stable")[: 20 * self._settings.candidates]
        for row in rows[best[scores[best] >= LEAST_SCORE]].astype(np.float64):
            radius = float(min(row[2], row[3])) / 2 / self._settings.scale
            if radius > 0:
                yield self._sighting(row[:2] - 0.5, radius, float(row[4 + self._settings.class_number]))


def _probabilities(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the values, if they can be probabilities; raises StageError otherwise."""
    low, high = float(values.min()), float(values.max())
    if low < -ROUNDING or high > 1 + ROUNDING:
        raise StageError(
            f"the network gives values from {low:.2f} to {high:.2f} where probabilities from 0 to 1 are meant; "
            "let it end in a sigmoid, and see that predict.detector.output and class_number fit it"
        )
    return values
