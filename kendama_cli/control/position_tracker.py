"""The flight of a ball whose places are told, not seen in images: the same onset and estimator as with cameras."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from kendama_cli.devices.camera.ball_tracker import catch_pose_estimator
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.catch_pose import CatchPoseEstimator
from kendama_cli.vision.onset import FreeFlightFound, FreeFlightOnset
from kendama_cli.vision.settings import MotionSettings, OnsetSettings


class PositionTracker:
    """Feeds ``estimator`` with places of free flight only; ``onset`` tells since when that is (see BallTracker).

    ``found`` is None until free flight is detected.
    """

    def __init__(self, estimator: CatchPoseEstimator, onset: FreeFlightOnset, covariance_m2: Array) -> None:
        self.estimator = estimator
        self._onset = onset
        self._covariance_m2 = covariance_m2
        self.reset()

    def reset(self) -> None:
        """Forget every place: the next one may belong to a new flight."""
        self.found: FreeFlightFound | None = None
        self._waiting: list[tuple[float, Array]] = []
        self._onset.reset()
        self.estimator.reset()

    @property
    def waits(self) -> bool:
        """Whether it has taken places, and does not know yet whether they are of free flight."""
        return bool(self._waiting)

    def update(self, t_s: float, ball_m: Array, tie_m: Array) -> None:
        """Take the ball's centre (3,) with the rope's tie point (3,) at ``t_s``, in order of time."""
        if self.found is not None:
            self.estimator.update_position(t_s, ball_m, self._covariance_m2)
            return
        self._waiting.append((t_s, ball_m))
        self.found = self._onset.update(t_s, ball_m, self._covariance_m2, tie_m)
        if self.found is None:
            return
        for t, place in self._waiting:
            if t >= self.found.since_s:
                self.estimator.update_position(t, place, self._covariance_m2)
        self._waiting = []


class TrackingSettings(Protocol):
    """What is believed of onset and flight, as PredictSettings has it."""

    @property
    def onset(self) -> OnsetSettings:
        """When the rope lets go."""

    @property
    def motion(self) -> MotionSettings:
        """How far the ball is believed to follow gravity and drag."""


def position_tracker(
    settings: TrackingSettings, game: GameSettings, rim_height_m: float, sigma_m: Sequence[float]
) -> PositionTracker:
    """The tracker of places with standard deviations ``sigma_m`` (3,), of the way down through ``rim_height_m``."""
    estimator = catch_pose_estimator(settings.motion, game, rim_height_m)
    onset = FreeFlightOnset(settings.onset, estimator.flight, game.cup.outer_radius_m)
    return PositionTracker(estimator, onset, np.diag(np.square(sigma_m)))
