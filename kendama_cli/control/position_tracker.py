"""Tracker of a flying ball by its measured positions, with the same onset and estimator as for images."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kendama_cli.physics.taut_rope import rope_angle
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.prediction.onset import FreeFlightFound, FreeFlightOnset
from kendama_cli.vision.prediction.tracker import catch_pose_estimator
from kendama_cli.vision.settings import MotionSettings, OnsetSettings


class PositionTracker:
    """Tracker that feeds ``estimator`` with positions of free flight only, from the onset on (see BallTracker).

    They have standard deviations ``sigma_m`` (3,); the estimate is of the descent through ``rim_height_m``. ``found``
    is None until free flight is detected.
    """

    def __init__(
        self,
        onset: OnsetSettings,
        motion: MotionSettings,
        game: GameSettings,
        *,
        rim_height_m: float,
        sigma_m: Sequence[float],
    ) -> None:
        self.estimator = catch_pose_estimator(motion, game, rim_height_m)
        self._onset = FreeFlightOnset(onset, self.estimator.flight, game.cup.outer_radius_m)
        self._covariance_m2 = np.diag(np.square(sigma_m))
        self.reset()

    def reset(self) -> None:
        """Forget every position: the next one may belong to a new flight."""
        self.found: FreeFlightFound | None = None
        self._waiting: list[tuple[float, Array]] = []
        self._onset.reset()
        self.estimator.reset()

    @property
    def waits(self) -> bool:
        """True if it has taken positions and does not know yet if they are of free flight."""
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
        for t, position in self._waiting:
            if t >= self.found.since_s:
                self.estimator.update_position(t, position, self._covariance_m2)
        self._waiting = []


def rope_angle_rad(ball_from_tie_m: Array) -> float:
    """Return the angle of the line from the tie point to the ball (3,) from straight down, in [0, pi]."""
    x, y, z = (float(value) for value in ball_from_tie_m)
    return rope_angle(math.hypot(x, y), z)
