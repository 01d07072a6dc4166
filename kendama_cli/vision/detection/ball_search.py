"""Search of the ball in each camera's image: the region, and the detection there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region, around, whole
from kendama_cli.vision.detection.interface import Detector, SearchHint, Sighting

MARGIN_PX = 10.0
EXPECTED_PX = 20.0
"""A ball that is released at an expected position is so much farther from it in every later image, at most."""
LOST_FRAMES = 5
"""After so many frames without the ball the whole image is searched again."""


@dataclass
class _ImageTrack:
    """Last detections of one camera."""

    t_s: float
    centre_px: Array
    speed_px_s: Array
    radius_px: float
    lost: int


@dataclass
class _Expected:
    """Start of the search."""

    hint: SearchHint
    half_px: float
    missed: int


class BallSearch:
    """Searches the ball in one image after the other, about its expected position.

    Each camera has a detector of its own, by ``make_detector``. ``ball_m`` gives the ball's position (3,) at a time,
    None where it is not known well enough to search by.
    """

    def __init__(
        self,
        cameras: Mapping[str, CameraModel],
        make_detector: Callable[[], Detector],
        ball_m: Callable[[float], Array | None],
    ) -> None:
        self._cameras = cameras
        self._detectors = {name: make_detector() for name in cameras}
        self._ball_m = ball_m
        self.reset()

    def reset(self) -> None:
        """Begin a new flight."""
        self._expected: dict[str, _Expected] = {}
        self.forget()

    def forget(self) -> None:
        """Forget what was found; what is expected stays."""
        self._tracks: dict[str, _ImageTrack] = {}

    def expect(self, ball_m: ArrayLike, half_px: float) -> None:
        """Begin the search about a roughly known position (3,), instead of in the whole image."""
        for name, model in self._cameras.items():
            hint = self._placed(model, np.asarray(ball_m, dtype=np.float64), 0.0)
            if hint is not None:
                self._expected[name] = _Expected(hint, half_px, 0)

    def region(self, camera: str, t_s: float) -> Region:
        """Return the region to search at ``t_s``: about the predicted position; the whole image when the ball was
        lost.
        """
        model = self._cameras[camera]
        image = whole(model.width_px, model.height_px)
        hint, half_px = self._hint(camera, t_s)
        box = image if hint is None else around(hint.centre_px, half_px).within(image)
        return image if box.empty else box

    def detect(self, camera: str, t_s: float, pixels: NDArray[np.uint8], origin_px: tuple[int, int]) -> Sighting | None:
        """Find the ball in one image (h, w, 3) of ``camera``; the next search begins from what is found."""
        track, expected = self._tracks.get(camera), self._expected.get(camera)
        hint, half_px = self._hint(camera, t_s)
        sighting = next(self._detectors[camera].candidates(pixels, origin_px, hint), None)
        if sighting is None or (hint is not None and np.abs(sighting.centre_px - hint.centre_px).max() > half_px):
            if track is not None:
                track.lost += 1
            elif expected is not None:
                expected.missed += 1
            return None
        speed = np.zeros(2)
        if track is not None and track.lost < LOST_FRAMES and t_s > track.t_s:
            speed = (sighting.centre_px - track.centre_px) / (t_s - track.t_s)
        self._tracks[camera] = _ImageTrack(t_s, sighting.centre_px, speed, sighting.radius_px, 0)
        self._expected.pop(camera, None)
        return sighting

    def _hint(self, camera: str, t_s: float) -> tuple[SearchHint | None, float]:
        """Return the expected position in the image, and its maximum error [px]; None without a prediction."""
        track, expected = self._tracks.get(camera), self._expected.get(camera)
        if track is None:
            if expected is None or expected.missed >= LOST_FRAMES:
                return None, np.inf
            return expected.hint, expected.half_px + EXPECTED_PX * expected.missed
        if track.lost >= LOST_FRAMES:
            return None, np.inf
        ball_m = self._ball_m(t_s)
        hint = None if ball_m is None else self._placed(self._cameras[camera], ball_m, track.radius_px)
        if hint is None:
            hint = SearchHint(track.centre_px + (t_s - track.t_s) * track.speed_px_s, track.radius_px)
        return hint, 1.6 * track.radius_px + MARGIN_PX * (1 + track.lost)

    def _placed(self, model: CameraModel, ball_m: Array, radius_px: float) -> SearchHint | None:
        """Return the hint of a ball of ``radius_px`` at ``ball_m`` (3,); None if out of sight."""
        pixel = model.project(ball_m)[0]
        return SearchHint(pixel, radius_px) if np.isfinite(pixel).all() else None
