"""Tracker from detections to the catch pose: outliers, the onset of free flight, the estimator."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.triangulation import RayConstraints, ray_constraints, triangulate
from kendama_cli.vision.detection.ball_search import BallSearch
from kendama_cli.vision.detection.interface import Detector, Sighting, make_detector
from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator
from kendama_cli.vision.prediction.free_flight import tilted_gravity
from kendama_cli.vision.prediction.onset import FreeFlightFound, FreeFlightOnset
from kendama_cli.vision.settings import MotionSettings, PredictSettings

SAME_MOMENT_S = 1e-4
TRUSTED_SIGMA_M = 0.02
GATE_PX, GATE_SIGMAS = 4.0, 5.0
"""A sighting farther from a trusted prediction than both is of something else, or of another time."""
CONTRADICTIONS = 6
"""So many sightings in a row, all far from the prediction, say that the prediction is what is wrong."""
ENOUGH_OBSERVATIONS, LARGE_RATIO = 32, 9.0
"""Eight frames of two cameras, and residuals of three times what their covariance allows."""
SAME_PX = 1e-6
"""Noise moves the centre from image to image by more: nearer, it is the same image again."""


class BallTracker:
    """Feeds the estimator with free flight only; ``search`` finds the ball in the images that it is fed from.

    The onset test runs on points triangulated from images of one time; without an ``onset`` every sighting counts
    as free flight from the start. An image that comes twice is taken once; a sighting far from a trusted prediction
    is refused, and when nothing else is seen any more the flight is given up: ``lost``, and begun anew.
    """

    def __init__(
        self,
        cameras: Sequence[CameraModel],
        make_detector: Callable[[], Detector],
        estimator: CatchPoseEstimator,
        onset: FreeFlightOnset | None = None,
    ) -> None:
        self.cameras = {camera.name: camera for camera in cameras}
        self.estimator = estimator
        self.onset = onset
        self.search = BallSearch(self.cameras, make_detector, self._trusted_m)
        self.reset()

    def reset(self) -> None:
        """Begin a new flight."""
        self.search.reset()
        self._begin()

    def _begin(self) -> None:
        self.found: FreeFlightFound | None = None
        self.lost = False
        self._refused = 0
        self._tested_s = -np.inf
        self._newest: dict[str, tuple[float, Array]] = {}
        self.search.forget()
        self._waiting: list[tuple[float, RayConstraints]] = []
        self.estimator.reset()
        if self.onset is not None:
            self.onset.reset()

    def update(
        self,
        t_s: float,
        sightings: Mapping[str, Sighting | None],
        tie_m: ArrayLike,
        own_s: Mapping[str, float] | None = None,
    ) -> CatchPose | None:
        """Take the detections of one time with the rope's tie point (3,) then; return the catch pose.

        A rolling shutter exposes the ball in one image a little before or after that in another: ``own_s`` has each
        sighting's own time, by camera.
        """
        times = {name: t_s if own_s is None else own_s[name] for name, seen in sightings.items() if seen is not None}
        sights = [
            (times[name], ball_sight(self.cameras[name], seen))
            for name, seen in sightings.items()
            if seen is not None and self._is_new(name, times[name], seen) and self._is_near(name, times[name], seen)
        ]
        if self._has_come_apart(t_s):
            self._refused += 1
        if self._refused >= CONTRADICTIONS:
            self._begin()
            self.lost = True
            return None
        self.lost = self.lost and not sights
        if self.onset is not None and self.found is None:
            self._waiting += sights
            self._test(t_s, [row for _, row in sights], tie_m)
        else:
            for own, row in sights:
                self.estimator.update_sight(own, row)
        return self.estimator.catch()

    def _has_come_apart(self, t_s: float) -> bool:
        """Return True if enough was seen to know the ball, but the residuals say that no flight fits it."""
        long = self.estimator.n_observations >= ENOUGH_OBSERVATIONS
        return long and self.estimator.residual_ratio > LARGE_RATIO and self._sigma_m(t_s) > TRUSTED_SIGMA_M

    def _is_new(self, camera: str, t_s: float, seen: Sighting) -> bool:
        """Return True if this image was not taken before, under its own stamp or another."""
        before_s, centre = self._newest.get(camera, (-np.inf, np.full(2, np.inf)))
        if t_s == before_s or float(np.abs(seen.centre_px - centre).max()) < SAME_PX:
            return False
        self._newest[camera] = (t_s, seen.centre_px)
        return True

    def _is_near(self, camera: str, t_s: float, seen: Sighting) -> bool:
        """Return True if a trusted prediction, if there is one, agrees."""
        model, sigma_m = self.cameras[camera], self._sigma_m(t_s)
        state = self.estimator.state_at(t_s)
        if state is None or sigma_m > TRUSTED_SIGMA_M:
            return True
        off = float(np.linalg.norm(model.project(state[:3])[0] - seen.centre_px))
        sigma_px = model.size_px(state[:3], sigma_m) if np.isfinite(off) else 0.0
        near = off <= max(GATE_PX, GATE_SIGMAS * float(np.hypot(sigma_px, np.sqrt(np.trace(seen.covariance_px2)))))
        self._refused = 0 if near else self._refused + 1
        return near

    def _sigma_m(self, t_s: float) -> float:
        covariance = self.estimator.position_covariance_at(t_s)
        return float("inf") if covariance is None else float(np.sqrt(max(np.trace(covariance), 0.0)))

    def _trusted_m(self, t_s: float) -> Array | None:
        """Return the estimated position of the ball (3,), if the estimate is good enough to search by."""
        state = self.estimator.state_at(t_s)
        return state[:3] if state is not None and self._sigma_m(t_s) < TRUSTED_SIGMA_M else None

    def _test(self, t_s: float, rows: Sequence[RayConstraints], tie_m: ArrayLike) -> None:
        point = triangulate(rows)
        if point is None or self.onset is None or t_s <= self._tested_s:  # a late image is used, but not tested
            return
        self._tested_s = t_s
        self.found = self.onset.update(t_s, point.position_m, point.covariance_m2, tie_m)
        if self.found is None:
            return
        for t, row in self._waiting:
            if t >= self.found.since_s - SAME_MOMENT_S:
                self.estimator.update_sight(t, row)
        self._waiting = []


def ball_sight(camera: CameraModel, seen: Sighting) -> RayConstraints:
    """Return the constraints that a detection puts on the ball's centre."""
    return ray_constraints(camera, sphere_centre(camera, seen.centre_px, seen.radius_px), seen.covariance_px2)


def sphere_centre(camera: CameraModel, disc_px: ArrayLike, radius_px: float) -> Array:
    """Return the sphere's centre in the image (2,) by the centre of its disc."""
    return camera.optics.sphere_centre(np.asarray(disc_px, dtype=np.float64), radius_px)


def catch_pose_estimator(
    motion: MotionSettings, game: GameSettings, rim_height_m: float, gravity_m_s2: float | Array | None = None
) -> CatchPoseEstimator:
    """Make the estimator of the ball's descent through ``rim_height_m``.

    ``gravity_m_s2`` is its size or (3,) in the frame that the ball is observed in; None: straight down, as in ``game``.
    """
    min_tension_m_s2 = game.gravity_m_s2 if gravity_m_s2 is None else gravity_m_s2
    drag_per_s, drag_per_m = game.drag_per_mass
    return CatchPoseEstimator(min_tension_m_s2, drag_per_s, rim_height_m, drag_per_m=drag_per_m, motion=motion)


def flight_estimator(settings: PredictSettings, game: GameSettings, rim_height_m: float) -> CatchPoseEstimator:
    """Make the estimator of ``settings``, with the gravity that the cameras see."""
    gravity_m_s2 = tilted_gravity(settings.gravity.scale * game.gravity_m_s2, settings.gravity.tilt_rad)
    return catch_pose_estimator(settings.motion, game, rim_height_m, gravity_m_s2)


def ball_tracker(
    settings: PredictSettings, game: GameSettings, models: Sequence[CameraModel], *, rim_height_m: float, onset: bool
) -> BallTracker:
    """Make the tracker of ``settings`` for these cameras, predicting the descent through ``rim_height_m``.

    Without ``onset`` every sighting counts as free flight. Raises InputError where a learned colour cannot be read.
    """
    estimator = flight_estimator(settings, game, rim_height_m)
    test = FreeFlightOnset(settings.onset, estimator.flight, game.cup.outer_radius_m) if onset else None
    make = partial(make_detector, settings.detector)
    return BallTracker(models, make, estimator, test)
