"""What follows the ball in images, put together once: the path that is studied is the path that plays."""

from __future__ import annotations

from collections.abc import Sequence

from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.catch_pose import CatchPoseEstimator
from kendama_cli.vision.free_flight import leaning_gravity
from kendama_cli.vision.make_detector import make_detector
from kendama_cli.vision.onset import FreeFlightOnset
from kendama_cli.vision.settings import PredictSettings
from kendama_cli.vision.tracker import BallTracker


def ball_tracker(
    settings: PredictSettings, game: GameSettings, models: Sequence[CameraModel], *, rim_height_m: float, onset: bool
) -> BallTracker:
    """The tracker that ``settings`` describe for these cameras, foreseeing the way down through ``rim_height_m``.

    Without ``onset`` every sighting counts as free flight. Raises InputError where a learned colour cannot be read.
    """
    gravity_m_s2 = leaning_gravity(settings.gravity.scale * game.gravity_m_s2, settings.gravity.tilt_rad)
    drag_per_s = game.ball.drag_n_s_m / game.ball.mass_kg
    estimator = CatchPoseEstimator(gravity_m_s2, drag_per_s, rim_height_m, motion=settings.motion)
    test = FreeFlightOnset(settings.onset, estimator.flight) if onset else None
    return BallTracker(models, make_detector(settings.detector), estimator, test)
