"""The scene of one known flight: what virtual cameras show where no simulator runs."""

from __future__ import annotations

import numpy as np

from kendama_cli.rendering.scene import ScenePose, hanging_rope
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.prediction.release import Release

SHOULDER_M = np.array([0.60, 0.55, -0.55])
ELBOW_OFF_MIDDLE_M = np.array([0.05, 0.02, 0.22])
WRIST_FROM_CUP_M = np.array([0.0, 0.06, -0.12])
HAND_FROM_CUP_M = np.array([0.0, 0.0, -0.04])


class StagedFlight:
    """Ball, cup, rope and an arm of one release, let go at ``release_s`` on the scene's own clock."""

    def __init__(self, release: Release, release_s: float, rope_m: float) -> None:
        self.release, self.release_s, self._rope_m = release, release_s, rope_m

    @property
    def crossing_s(self) -> float:
        """Return the time at which the ball crosses the rim plane, on the scene's clock."""
        return self.release_s + self.release.crossing_s

    def seen_until_s(self, fraction: float) -> float:
        """Return the time at which ``fraction`` of the free flight has passed."""
        return self.release_s + fraction * self.release.crossing_s

    def tie_m(self, t_s: float) -> Array:
        """Return the cup's tie point (3,), as the arm knows it."""
        return self.release.tie_m(t_s - self.release_s)

    def ball_m(self, t_s: float) -> Array:
        """Return the ball's centre (3,)."""
        return self.release.ball_m(t_s - self.release_s)

    def scene(self, t_s: float) -> ScenePose:
        """Return all poses."""
        ball, tie = self.ball_m(t_s), self.tie_m(t_s)
        wrist = tie + WRIST_FROM_CUP_M
        elbow = (SHOULDER_M + wrist) / 2 + ELBOW_OFF_MIDDLE_M
        return ScenePose(
            ball_m=ball,
            cup_m=tie,
            cup_rotation=np.eye(3),
            rope_m=hanging_rope(tie, ball, self._rope_m),
            arm_m=np.array([SHOULDER_M, elbow, wrist, tie + HAND_FROM_CUP_M]),
        )
