"""Where in each camera's image the ball is searched, and what is found there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.interface import BackgroundDetector, Detector, Image, SearchHint, Sighting
from kendama_cli.vision.painted_size import PaintedSize
from kendama_cli.vision.region import Region, around, whole

MARGIN_PX = 10.0
EXPECTED_PX = 20.0
"""A ball that is let go at an expected place is so much farther from it in every later image, at most."""
LOST_FRAMES = 5
"""After so many frames without the ball the whole image is searched again."""
STREAKS_AN_IMAGE = 3.0
"""A ball of which one image alone is known is in the next at most so many of its streaks away."""
BACKGROUND_IMAGES = (1, 7)
"""A background is taken from a flight's first whole image, and better from so many: by then the ball has moved on."""
KEPT_IMAGES = 21
"""Those of the flights before are kept, so many in all: what stood elsewhere then hides nothing."""


@dataclass
class _ImageTrack:
    """What one camera saw last."""

    t_s: float
    centre_px: Array
    speed_px_s: Array
    radius_px: float
    sized_px: float | None
    """the ball's true radius in the image, as it was where the search began"""
    lost: int
    reach_px: float
    """how much farther it may be in the next image, where only its streak says how fast it is"""


@dataclass
class _Expected:
    """Where the search begins."""

    hint: SearchHint
    half_px: float
    missed: int


class BallSearch:
    """Searches the ball in one image after the other, about the place where it should be by now.

    Each camera has a detector of its own, by ``make_detector``; one that must know the background is given the flight's
    first images, whole. ``ball_m`` gives the ball's place (3,) at a time, None where none is known well enough to
    search by; with ``ball_radius_m`` its size in the image is known too then, and better once two cameras see a ball of
    several colours (``PaintedSize``).
    """

    def __init__(
        self,
        cameras: Mapping[str, CameraModel],
        make_detector: Callable[[], Detector],
        ball_m: Callable[[float], Array | None],
        ball_radius_m: float | None = None,
    ) -> None:
        self._cameras = cameras
        self._behind: dict[str, list[Image]] = {}
        self._detectors = {name: make_detector() for name in cameras}
        self._ball_m, self._ball_radius_m = ball_m, ball_radius_m
        self._painted = None if ball_radius_m is None else PaintedSize(cameras, ball_radius_m)
        self.reset()

    def reset(self) -> None:
        """Begin a new flight."""
        self._expected: dict[str, _Expected] = {}
        for name, detector in self._detectors.items():
            if isinstance(detector, BackgroundDetector):
                self._behind[name] = self._behind.get(name, [])[BACKGROUND_IMAGES[-1] - KEPT_IMAGES :]
        self._taken = dict.fromkeys(self._behind, 0)
        if self._painted is not None:
            self._painted.reset()
        self.forget()

    def forget(self) -> None:
        """Forget what was found; what is expected stays."""
        self._tracks: dict[str, _ImageTrack] = {}

    def expect(self, ball_m: ArrayLike, half_px: float) -> None:
        """Begin the search about a roughly known place (3,), instead of in the whole image."""
        for name, model in self._cameras.items():
            hint = self._placed(model, np.asarray(ball_m, dtype=np.float64), 0.0)
            if hint is not None:
                self._expected[name] = _Expected(hint, half_px, 0)

    def region(self, camera: str, t_s: float) -> Region:
        """Where to search the ball at ``t_s``: about its predicted place; the whole image when it was lost."""
        model = self._cameras[camera]
        image = whole(model.width_px, model.height_px)
        if self._taken.get(camera, BACKGROUND_IMAGES[-1]) < BACKGROUND_IMAGES[-1]:
            return image
        hint, half_px = self._hint(camera, t_s)
        box = image if hint is None else around(hint.centre_px, half_px).within(image)
        return image if box.empty else box

    def detect(self, camera: str, t_s: float, pixels: NDArray[np.uint8], origin_px: tuple[int, int]) -> Sighting | None:
        """Find the ball in one image (h, w, 3) of ``camera``; the next search begins from what is found."""
        track, expected = self._tracks.get(camera), self._expected.get(camera)
        hint, half_px = self._hint(camera, t_s)
        if hint is not None and self._painted is not None:
            hint = replace(hint, painted_px=self._painted.radius_px(camera, t_s))
        self._learn(camera, pixels)
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
        reach_px = 0.0
        if not speed.any() and sighting.streak is not None:
            reach_px = STREAKS_AN_IMAGE * float(np.hypot(*sighting.streak.way_px))
        sized_px = track.sized_px if track is not None else _size(hint)
        self._tracks[camera] = _ImageTrack(t_s, sighting.centre_px, speed, sighting.radius_px, sized_px, 0, reach_px)
        self._expected.pop(camera, None)
        if self._painted is not None:
            self._painted.see(camera, t_s, sighting)
        return sighting

    def _learn(self, camera: str, pixels: Image) -> None:
        """Show the detector the background, where it must know it and ``pixels`` are a whole image."""
        detector, model = self._detectors[camera], self._cameras[camera]
        if (
            isinstance(detector, BackgroundDetector)
            and self._taken[camera] < BACKGROUND_IMAGES[-1]
            and pixels.shape[:2] == (model.height_px, model.width_px)
        ):
            self._behind[camera].append(pixels)
            self._taken[camera] += 1
            if self._taken[camera] in BACKGROUND_IMAGES:
                detector.learn(self._behind[camera])

    def _hint(self, camera: str, t_s: float) -> tuple[SearchHint | None, float]:
        """Where the ball should be in the image, and how far from there at most [px]; None where nothing says."""
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
            centre_px = track.centre_px + (t_s - track.t_s) * track.speed_px_s
            hint = SearchHint(centre_px, track.sized_px or track.radius_px, is_sized=track.sized_px is not None)
        return hint, 1.6 * track.radius_px + MARGIN_PX * (1 + track.lost) + track.reach_px

    def _placed(self, model: CameraModel, ball_m: Array, radius_px: float) -> SearchHint | None:
        """The hint of a ball at ``ball_m`` (3,), of ``radius_px`` where its size is not known; None if out of sight."""
        pixel = model.project(ball_m)[0]
        if not np.isfinite(pixel).all():
            return None
        if self._ball_radius_m is None:
            return SearchHint(pixel, radius_px)
        return SearchHint(pixel, model.size_px(ball_m, self._ball_radius_m), True)


def _size(hint: SearchHint | None) -> float | None:
    return hint.radius_px if hint is not None and hint.is_sized else None
