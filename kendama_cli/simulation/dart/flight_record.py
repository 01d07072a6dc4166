"""What is seen of the ball while a motion plays: how high it flies, and where it comes down at the rim."""

from __future__ import annotations

import math

from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.world_pair import STEP_S


class FlightRecord:
    """Watches ``ball`` step by step, from hanging still at time 0.

    ``apex_m`` is the largest height of its centre over the cup's place, ``swing_slack_s`` the longest time for which
    the rope was slack before the flight. ``miss_m`` (x, y) and ``flight_s`` are None until the ball comes down through
    the rim's plane; what they mean is in RolloutResult.
    """

    def __init__(self, ball: TetheredBall) -> None:
        self._ball, self._rim_m = ball, ball.game.cup.rim_m
        self._plane_m = ball.game.cup.rim_m + ball.game.ball.radius_m
        self._above, self._taut_s, self._slack_steps = False, 0.0, 0
        self.apex_m, self.swing_slack_s = -math.inf, 0.0
        self.miss_m: tuple[float, float] | None = None
        self.flight_s: tuple[float, float] | None = None

    def observe(self, t_s: float) -> None:
        """Look at the ball after the step that ended at ``t_s``."""
        ball = self._ball
        height = float(ball.position_m[2] - ball.tie_m[2])
        self.apex_m = max(self.apex_m, height)
        if ball.tension_n > 0.0:
            if self.flight_s is None:
                self.swing_slack_s = max(self.swing_slack_s, self._slack_steps * STEP_S)
            self._taut_s, self._slack_steps = t_s, 0
        else:
            self._slack_steps += 1
        if self._above and height <= self._plane_m and self.flight_s is None:
            fall_m = height - self._rim_m
            self.miss_m = self._miss(0, fall_m), self._miss(1, fall_m)
            self.flight_s = self._taut_s, t_s
        self._above = height > self._plane_m

    def _miss(self, axis: int, fall_m: float) -> float:
        ball = self._ball
        down = max(float(ball.tie_m_s[2] - ball.velocity_m_s[2]), 1e-3)
        aside = float(ball.velocity_m_s[axis] - ball.tie_m_s[axis])
        return float(ball.position_m[axis] - ball.tie_m[axis]) + aside * fall_m / down
