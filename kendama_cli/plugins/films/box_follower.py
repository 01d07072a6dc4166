"""An object with boxes, followed through a video: found by the trained detector, placed by the boxes' pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.plugins.films.ball_box import TrainedImage
from kendama_cli.plugins.films.ball_film import track
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.trained_detector import TrainedDetector
from kendama_cli.plugins.films.training import teach
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Image, SearchHint, Sighting

DETECTOR = TrainedDetectorSettings("trained", "", 1, 0.25, 6)
"""Settings as in conf/predict/detector/trained.yaml, which a test holds equal."""
REACH_RADII = 2.0
"""With twice the radius the detector searches eight radii about the last place."""
LOST_EVERY = 3
"""Every third image is searched whole for an object that was lost."""
MARGIN = 1.15
"""A picture shows a box with some of its surroundings."""
PLACED_RADII = 0.8
"""A peak of the detector may be so far from the object's middle."""
LIKE = 0.6
"""A correlation from which a picture says where the object is."""


@dataclass(frozen=True)
class BoxTrack:
    """Images (k,) in which an object is seen, its places (k, 2) in them [px], and its usual radius [px]."""

    frames: NDArray[np.int64]
    places_px: Array
    radius_px: float


class BoxFollower:
    """Follows the object in the boxes of ``images``; with ``pictures`` it is placed by them, as what keeps its shape.

    ``see`` takes the images of the video one by one, then ``track`` returns where the object is in them.
    Raises ValueError where the boxes teach nothing.
    """

    def __init__(self, images: Sequence[TrainedImage], seed: int, *, pictures: bool) -> None:
        ball = teach(images, seed)
        self._radius_px = ball.radius_px
        self._detector = TrainedDetector(DETECTOR, ball)
        self._placer = Placer(images) if pictures else None
        self._last: Array | None = None
        self._found: list[list[Sighting]] = []

    def see(self, pixels: Image) -> None:
        """Take the next image: what was seen in the last one is searched near its place first."""
        found: list[Sighting] = []
        if self._last is not None:
            hint = SearchHint(self._last, REACH_RADII * self._radius_px)
            found = list(self._detector.candidates(pixels, hint=hint))
        if not _sure(found) and (self._last is not None or len(self._found) % LOST_EVERY == 0):
            found = list(self._detector.candidates(pixels))
        if self._placer is not None:
            found = [replace(one, centre_px=self._placer.placed(pixels, one.centre_px)) for one in found]
        self._last = max(found, key=lambda one: one.score).centre_px if _sure(found) else None
        self._found.append(found)

    def track(self) -> BoxTrack:
        """Return the object's track through the images that were seen."""
        seen = [one for one in track(self._found, DETECTOR.score_min) if one is not None]
        places = np.array([one.sighting.centre_px for one in seen], dtype=np.float64).reshape(-1, 2)
        return BoxTrack(np.array([one.frame for one in seen], dtype=np.int64), places, self._radius_px)


def _sure(found: Sequence[Sighting]) -> bool:
    return any(one.score >= DETECTOR.score_min for one in found)


class Placer:
    """Places an object that keeps its shape where its boxes' pictures correlate with the image.

    A detector's peak is known to a sixth of the radius, and strays where another object touches. Boxes are drawn to a
    pixel or two: the object's middle in each picture is that of the picture which resembles the others most, and all
    together have the mean of their boxes.
    """

    def __init__(self, images: Sequence[TrainedImage]) -> None:
        boxes = [(image.pixels, box) for image in images for box in image.boxes]
        sides = np.median([(box.width_px, box.height_px) for _, box in boxes], axis=0)
        self._size = np.maximum(np.rint(sides * MARGIN), 5).astype(int)
        self._reach = int(np.ceil(PLACED_RADII * sides.min() / 2))
        centres = [np.array([box.u_px, box.v_px]) for _, box in boxes]
        around = [self._cut(pixels, one, self._reach) for (pixels, _), one in zip(boxes, centres, strict=True)]
        self._pictures = [self._cut(pixels, one, 0) for (pixels, _), one in zip(boxes, centres, strict=True)]
        alike = [[_best(one, picture) for one in around] for picture in self._pictures]
        first = max(alike, key=lambda some: sum(score for score, _ in some))
        middles = np.array([shift if score > LIKE else np.zeros(2) for score, shift in first])
        self._middles = middles - middles.mean(axis=0)

    def placed(self, pixels: Image, centre_px: Array) -> Array:
        """Return the object's middle (2,) [px] near ``centre_px``; that itself where no picture resembles the image."""
        around = self._cut(pixels, centre_px, self._reach)
        found = [_best(around, picture) for picture in self._pictures]
        best = max(range(len(found)), key=lambda i: found[i][0])
        score, shift = found[best]
        return np.asarray(centre_px + shift + self._middles[best]) if score > LIKE else centre_px

    def _cut(self, pixels: Image, centre_px: Array, reach_px: int) -> Image:
        width, height = (self._size + 2 * reach_px).tolist()
        u, v = np.asarray(centre_px).tolist()
        return np.asarray(cv2.getRectSubPix(pixels, (width, height), (u, v)), dtype=np.uint8)


def _best(around: Image, picture: Image) -> tuple[float, Array]:
    """Return the highest correlation of ``picture`` in ``around``, and its place (2,) from the middle [px]."""
    scores = cv2.matchTemplate(around, picture, cv2.TM_CCOEFF_NORMED)
    _, score, _, (column, row) = cv2.minMaxLoc(scores)
    shift = np.array([column, row], dtype=np.float64)
    for axis, line in enumerate((scores[row], scores[:, column])):
        at = (column, row)[axis]
        if 0 < at < len(line) - 1:
            low, high = float(line[at - 1]), float(line[at + 1])
            shift[axis] += (low - high) / (2 * min(low + high - 2 * score, -1e-9))
    return float(score), shift - (np.array(scores.shape[::-1]) - 1) / 2
