"""From frames to the catching pose: detection, region of interest, onset of free flight, estimator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.catch_pose import CatchPoseEstimator
from kendama_cli.vision.interface import Detector, SearchHint, Sighting
from kendama_cli.vision.onset import FreeFlightFound, FreeFlightOnset
from kendama_cli.vision.region import Region, around, whole
from kendama_cli.vision.triangulation import NEAREST_DEPTH_M, SightRows, sight_rows, triangulate

MARGIN_PX = 10.0
LOST_FRAMES = 5
"""After so many frames without the ball the whole image is searched again."""
SAME_MOMENT_S = 1e-4
TRUSTED_SIGMA_M = 0.02
GATE_PX, GATE_SIGMAS = 4.0, 5.0
"""A sighting farther from a trusted prediction than both is of something else, or of another moment."""
CONTRADICTIONS = 6
"""So many sightings in a row, all far from the prediction, say that the prediction is what is wrong."""
ENOUGH_OBSERVATIONS, LARGE_RATIO = 32, 9.0
"""Eight frames of two cameras, and residuals of three times what their covariance allows."""
SAME_PX = 1e-6
"""Noise moves the centre from image to image by more: nearer, it is the same image again."""


@dataclass
class _Track:
    """What one camera saw last."""

    t_s: float
    centre_px: Array
    speed_px_s: Array
    radius_px: float
    lost: int


class BallTracker:
    """Follows the ball in every camera and feeds the estimator with free flight only.

    The onset test runs on points triangulated from images of one moment; without an ``onset`` every sighting counts
    as free flight from the start. An image that comes twice is taken once; a sighting far from a trusted prediction
    is refused, and when nothing else is seen any more the flight is given up: ``lost``, and begun anew.
    """

    def __init__(
        self,
        cameras: Sequence[CameraModel],
        detector: Detector,
        estimator: CatchPoseEstimator,
        onset: FreeFlightOnset | None = None,
    ) -> None:
        self.cameras = {camera.name: camera for camera in cameras}
        self.estimator = estimator
        self.onset = onset
        self._detector = detector
        self.reset()

    def reset(self) -> None:
        """Begin a new flight."""
        self._expected: dict[str, Region] = {}
        self._begin()

    def _begin(self) -> None:
        self.found: FreeFlightFound | None = None
        self.lost = False
        self._refused = 0
        self._tested_s = -np.inf
        self._newest: dict[str, tuple[float, Array]] = {}
        self._tracks: dict[str, _Track] = {}
        self._waiting: list[tuple[float, SightRows]] = []
        self.estimator.reset()
        if self.onset is not None:
            self.onset.reset()

    def expect(self, ball_m: ArrayLike, half_px: float) -> None:
        """Begin the search about a roughly known place (3,), instead of in the whole image."""
        for name, model in self.cameras.items():
            pixel = model.project(ball_m)[0]
            if np.isfinite(pixel).all():
                self._expected[name] = around(pixel, half_px)

    def region(self, camera: str, t_s: float) -> Region:
        """Where to look for the ball at ``t_s``: about its predicted place; the whole image when it was lost."""
        model = self.cameras[camera]
        image = whole(model.width_px, model.height_px)
        track = self._tracks.get(camera)
        if track is None and camera in self._expected:
            box = self._expected[camera].within(image)
            return image if box.empty else box
        if track is None or track.lost >= LOST_FRAMES:
            return image
        box = around(self._centre(model, track, t_s), 1.6 * track.radius_px + MARGIN_PX * (1 + track.lost)).within(
            image
        )
        return image if box.empty else box

    def look(self, camera: str, t_s: float, pixels: NDArray[np.uint8], origin_px: tuple[int, int]) -> Sighting | None:
        """Find the ball in one image; what is found is kept as this camera's track. Feeds nothing yet."""
        track = self._tracks.get(camera)
        followed = track is not None and track.lost < LOST_FRAMES
        hint = None
        if track is not None and followed:
            hint = SearchHint(self._centre(self.cameras[camera], track, t_s), track.radius_px)
        sighting = next(self._detector.candidates(pixels, origin_px, hint), None)
        self._expected.pop(camera, None)
        if sighting is None:
            if track is not None:
                track.lost += 1
            return None
        speed = np.zeros(2)
        if track is not None and track.lost < LOST_FRAMES and t_s > track.t_s:
            speed = (sighting.centre_px - track.centre_px) / (t_s - track.t_s)
        self._tracks[camera] = _Track(t_s, sighting.centre_px, speed, sighting.radius_px, 0)
        return sighting

    def update(self, t_s: float, sightings: Mapping[str, Sighting | None], tie_m: ArrayLike) -> CatchPose | None:
        """Take the sightings of one moment with the rope's tie point (3,) at that moment; give the catching pose."""
        rows = [
            self._rows(name, seen)
            for name, seen in sightings.items()
            if seen is not None and self._is_new(name, t_s, seen) and self._is_near(name, t_s, seen)
        ]
        if self._has_come_apart(t_s):
            self._refused += 1
        if self._refused >= CONTRADICTIONS:
            self._begin()
            self.lost = True
            return None
        self.lost = self.lost and not rows
        if self.onset is not None and self.found is None:
            self._waiting += [(t_s, row) for row in rows]
            self._test(t_s, rows, tie_m)
        else:
            for row in rows:
                self.estimator.update_sight(t_s, row)
        return self.estimator.catch()

    def _has_come_apart(self, t_s: float) -> bool:
        """Whether so much was seen that the ball should be known, but the residuals say that no flight fits it."""
        long = self.estimator.n_observations >= ENOUGH_OBSERVATIONS
        return long and self.estimator.residual_ratio > LARGE_RATIO and self._sigma_m(t_s) > TRUSTED_SIGMA_M

    def _is_new(self, camera: str, t_s: float, seen: Sighting) -> bool:
        """Whether this is not an image that was taken before, under its own stamp or another."""
        before_s, centre = self._newest.get(camera, (-np.inf, np.full(2, np.inf)))
        if t_s == before_s or float(np.abs(seen.centre_px - centre).max()) < SAME_PX:
            return False
        self._newest[camera] = (t_s, seen.centre_px)
        return True

    def _is_near(self, camera: str, t_s: float, seen: Sighting) -> bool:
        """Whether a trusted prediction, where there is one, agrees."""
        model, sigma_m = self.cameras[camera], self._sigma_m(t_s)
        state = self.estimator.state_at(t_s)
        if state is None or sigma_m > TRUSTED_SIGMA_M:
            return True
        off = float(np.linalg.norm(model.project(state[:3])[0] - seen.centre_px))
        sigma_px = sigma_m * float(model.focal_px[0]) / max(float(model.depth_m(state[:3])), NEAREST_DEPTH_M)
        near = off <= max(GATE_PX, GATE_SIGMAS * float(np.hypot(sigma_px, np.sqrt(np.trace(seen.covariance_px2)))))
        self._refused = 0 if near else self._refused + 1
        return near

    def _sigma_m(self, t_s: float) -> float:
        covariance = self.estimator.position_covariance_at(t_s)
        return float("inf") if covariance is None else float(np.sqrt(max(np.trace(covariance), 0.0)))

    def _test(self, t_s: float, rows: Sequence[SightRows], tie_m: ArrayLike) -> None:
        point = triangulate(rows)
        if point is None or self.onset is None or t_s <= self._tested_s:  # a late image: kept, but no more tested
            return
        self._tested_s = t_s
        self.found = self.onset.update(t_s, point.position_m, point.covariance_m2, tie_m)
        if self.found is None:
            return
        for t, row in self._waiting:
            if t >= self.found.since_s - SAME_MOMENT_S:
                self.estimator.update_sight(t, row)
        self._waiting = []

    def _rows(self, camera: str, seen: Sighting) -> SightRows:
        model = self.cameras[camera]
        return sight_rows(model, sphere_centre(model, seen.centre_px, seen.radius_px), seen.covariance_px2)

    def _centre(self, model: CameraModel, track: _Track, t_s: float) -> Array:
        """Where the ball should be in the image: by the estimate where that is trusted, else as it moved last."""
        state = self.estimator.state_at(t_s)
        if state is not None and self._sigma_m(t_s) < TRUSTED_SIGMA_M:
            pixel = model.project(state[:3])[0]
            if np.isfinite(pixel).all():
                return np.asarray(pixel)
        return np.asarray(track.centre_px + (t_s - track.t_s) * track.speed_px_s)


def sphere_centre(camera: CameraModel, disc_px: ArrayLike, radius_px: float) -> Array:
    """The image (2,) of a sphere's centre, from the centre (2,) of its disc.

    A sphere seen under the half angle alpha at the angle theta off the axis has its disc's centre at
    tan(theta) cos^2(theta) / (cos^2(theta) - sin^2(alpha)); for a small ball alpha / cos(theta) is radius / focal.
    """
    shrink = 1 - (radius_px / float(camera.focal_px.mean())) ** 2
    return np.asarray(camera.center_px + shrink * (np.asarray(disc_px, dtype=np.float64) - camera.center_px))
