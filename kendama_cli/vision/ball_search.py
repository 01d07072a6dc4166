"""Where in each camera's image the ball is searched, and what is found there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.interface import BackgroundDetector, Detector, Image, SearchHint, Sighting
from kendama_cli.vision.region import Region, around, whole

MARGIN_PX = 10.0
LOST_FRAMES = 5
"""After so many frames without the ball the whole image is searched again."""
BACKGROUND_IMAGES = (1, 7)
"""A background is taken from the first whole image, and better from so many: by then the ball has moved on."""


@dataclass
class _ImageTrack:
    """What one camera saw last."""

    t_s: float
    centre_px: Array
    speed_px_s: Array
    radius_px: float
    lost: int


class BallSearch:
    """Searches the ball in one image after the other, about the place where it should be by now.

    Each camera has a detector of its own, by ``make_detector``; one that must know the background is given the flight's
    first images, whole. ``ball_m`` gives the ball's place (3,) at a time, None where none is known well enough to
    search by.
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
        self._expected: dict[str, Region] = {}
        self._behind: dict[str, list[Image]] = {
            name: [] for name, one in self._detectors.items() if isinstance(one, BackgroundDetector)
        }
        self.forget()

    def forget(self) -> None:
        """Forget what was found; what is expected stays."""
        self._tracks: dict[str, _ImageTrack] = {}

    def expect(self, ball_m: ArrayLike, half_px: float) -> None:
        """Begin the search about a roughly known place (3,), instead of in the whole image."""
        for name, model in self._cameras.items():
            pixel = model.project(ball_m)[0]
            if np.isfinite(pixel).all():
                self._expected[name] = around(pixel, half_px)

    def region(self, camera: str, t_s: float) -> Region:
        """Where to search the ball at ``t_s``: about its predicted place; the whole image when it was lost."""
        model = self._cameras[camera]
        image = whole(model.width_px, model.height_px)
        if camera in self._behind and len(self._behind[camera]) < BACKGROUND_IMAGES[-1]:
            return image
        track = self._tracks.get(camera)
        if track is None and camera in self._expected:
            box = self._expected[camera].within(image)
            return image if box.empty else box
        if track is None or track.lost >= LOST_FRAMES:
            return image
        half_px = 1.6 * track.radius_px + MARGIN_PX * (1 + track.lost)
        box = around(self._centre_px(model, track, t_s), half_px).within(image)
        return image if box.empty else box

    def detect(self, camera: str, t_s: float, pixels: NDArray[np.uint8], origin_px: tuple[int, int]) -> Sighting | None:
        """Find the ball in one image (h, w, 3) of ``camera``; the next search begins from what is found."""
        track = self._tracks.get(camera)
        followed = track is not None and track.lost < LOST_FRAMES
        hint = None
        if track is not None and followed:
            hint = SearchHint(self._centre_px(self._cameras[camera], track, t_s), track.radius_px)
        self._learn(camera, pixels)
        sighting = next(self._detectors[camera].candidates(pixels, origin_px, hint), None)
        self._expected.pop(camera, None)
        if sighting is None:
            if track is not None:
                track.lost += 1
            return None
        speed = np.zeros(2)
        if track is not None and followed and t_s > track.t_s:
            speed = (sighting.centre_px - track.centre_px) / (t_s - track.t_s)
        self._tracks[camera] = _ImageTrack(t_s, sighting.centre_px, speed, sighting.radius_px, 0)
        return sighting

    def _learn(self, camera: str, pixels: Image) -> None:
        """Show the detector the background, where it must know it and ``pixels`` are a whole image."""
        detector, model, images = self._detectors[camera], self._cameras[camera], self._behind.get(camera, [])
        if (
            isinstance(detector, BackgroundDetector)
            and len(images) < BACKGROUND_IMAGES[-1]
            and pixels.shape[:2] == (model.height_px, model.width_px)
        ):
            images.append(pixels)
            if len(images) in BACKGROUND_IMAGES:
                detector.learn(images)

    def _centre_px(self, model: CameraModel, track: _ImageTrack, t_s: float) -> Array:
        """Where the ball should be in the image: by its known place where there is one, else as it moved last."""
        ball_m = self._ball_m(t_s)
        if ball_m is not None:
            pixel = model.project(ball_m)[0]
            if np.isfinite(pixel).all():
                return np.asarray(pixel)
        return np.asarray(track.centre_px + (t_s - track.t_s) * track.speed_px_s)
