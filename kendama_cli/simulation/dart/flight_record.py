"""The ball as it is seen while a motion plays: how high it flies, and where it comes down at the rim."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kendama_cli.physics.rim_crossing import SLACK_S, at_rim_m, falls, is_caught, over_rim, planned_descent
from kendama_cli.robot_model.arm_motion import SAMPLE_S as STEP_S
from kendama_cli.simulation.dart.ball import TetheredBall


@dataclass(frozen=True)
class Descent:
    """The first descent of a flight through the rim's plane: from when to when the rope was slack, x and y there.

    ``swing_slack_s`` is the longest time for which the rope was slack before that flight.
    """

    flight_s: tuple[float, float]
    miss_m: tuple[float, float]
    swing_slack_s: float


class FlightRecord:
    """Watches ``ball`` step by step, from hanging still at time 0; the catch is planned from ``catch_from_s`` on.

    ``apex_m`` is the largest height of its centre over the cup's place.
    """

    def __init__(self, ball: TetheredBall, catch_from_s: float = 0.0) -> None:
        self._ball, self._catch_from_s = ball, catch_from_s
        self._taut_s, self._slack_steps, self._longest_s = 0.0, 0, 0.0
        self._before: tuple[float, float, float] | None = None
        self._fallen = False
        self._descents: list[Descent] = []
        self.apex_m = -math.inf

    def observe(self, t_s: float) -> None:
        """Look at the ball after the step that ended at ``t_s``."""
        ball = self._ball
        apart = ball.position_m - ball.tie_m
        self.apex_m = max(self.apex_m, float(apart[2]))
        if ball.tension_n > 0.0:
            self._longest_s = max(self._longest_s, self._slack_steps * STEP_S)
            self._taut_s, self._slack_steps, self._before, self._fallen = t_s, 0, None, False
            return
        self._slack_steps += 1
        if self._fallen:
            return
        radius_m, before = ball.game.ball.radius_m, self._before
        self._before = now = over_rim(apart.tolist(), ball.axis.tolist(), ball.game.cup.rim_m)
        if before is None or not falls(before[2] - radius_m, now[2] - radius_m):
            return
        if t_s - self._taut_s >= SLACK_S - 0.5 * STEP_S:
            self._fallen = True
            self._descents.append(Descent((self._taut_s, t_s), at_rim_m(before, now), self._longest_s))

    @property
    def descent(self) -> Descent | None:
        """The descent next to the planned catch; None where the ball never came down on a slack rope."""
        which = planned_descent([one.flight_s[1] for one in self._descents], self._catch_from_s)
        return None if which is None else self._descents[which]

    @property
    def swing_slack_s(self) -> float:
        """The longest time for which the rope was slack before the flight."""
        return self._longest_s if self.descent is None else self.descent.swing_slack_s

    @property
    def miss_m(self) -> tuple[float, float] | None:
        """The place (x, y) beside the cup's axis at which that descent reaches the rim's plane; None without one."""
        return None if self.descent is None else self.descent.miss_m

    @property
    def caught(self) -> bool:
        """Return True if the ball is in the cup and that descent led it there."""
        return is_caught(self._ball.is_in_cup(), self.miss_m, self._ball.game.cup.radius_m)
