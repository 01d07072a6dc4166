"""Trackers of the ball in images, put together once: the path that is studied is the path that plays."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.detection.make_detector import make_detector
from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator
from kendama_cli.vision.prediction.free_flight import tilted_gravity
from kendama_cli.vision.prediction.onset import FreeFlightOnset
from kendama_cli.vision.prediction.tracker import BallTracker
from kendama_cli.vision.settings import MotionSettings, PredictSettings


def catch_pose_estimator(
    motion: MotionSettings, game: GameSettings, rim_height_m: float, gravity_m_s2: float | Array | None = None
) -> CatchPoseEstimator:
    """Make the one estimator, of the ball's way down through ``rim_height_m``.

    ``gravity_m_s2`` is its size or (3,) in the frame that the ball is observed in; None: straight down, as in ``game``.
    """
    min_tension_m_s2 = game.gravity_m_s2 if gravity_m_s2 is None else gravity_m_s2
    drag_per_s, drag_per_m = game.drag_per_mass
    return CatchPoseEstimator(min_tension_m_s2, drag_per_s, rim_height_m, drag_per_m=drag_per_m, motion=motion)


def ball_tracker(
    settings: PredictSettings, game: GameSettings, models: Sequence[CameraModel], *, rim_height_m: float, onset: bool
) -> BallTracker:
    """Make the tracker of ``settings`` for these cameras, predicting the way down through ``rim_height_m``.

    Without ``onset`` every sighting counts as free flight. Raises InputError where a learned colour cannot be read.
    """
    gravity_m_s2 = tilted_gravity(settings.gravity.scale * game.gravity_m_s2, settings.gravity.tilt_rad)
    estimator = catch_pose_estimator(settings.motion, game, rim_height_m, gravity_m_s2)
    test = FreeFlightOnset(settings.onset, estimator.flight, game.cup.outer_radius_m) if onset else None
    make = partial(make_detector, settings.detector)
    return BallTracker(models, make, estimator, test)
