"""How the cup tilts to the ball that it meets, and gives with it."""

from __future__ import annotations

import math

from kendama_cli.game.cup_tilt import CupTilt
from kendama_cli.game.interception import plan_interception
from kendama_cli.game.settings import CatchSettings
from kendama_cli.schema.arrays import Array

TILT_LIMIT_RAD_S2 = 60.0
UPRIGHT_AFTER_S = 0.4
"""The cup is upright again so long after the catch."""


class TiltPlan:
    """Tilt and lift from the goal to the end of the game, in steps of ``period_s``.

    Both are cubics that are planned anew at every call: the tilt reaches the wanted one at the catch and rests there,
    the lift comes back to 0 there with the speed at which the cup gives, and is braked afterwards.
    """

    def __init__(self, catch: CatchSettings, period_s: float) -> None:
        self._catch, self._period_s = catch, period_s
        self._tilt, self._lift = [0.0, 0.0], [0.0, 0.0]
        self._kept = (0.0, 0.0)  # where nothing was planned in time, the cup stays as it is

    @property
    def flat(self) -> bool:
        """Whether the settings want neither."""
        return self._catch.max_tilt_rad == 0.0 and self._catch.give_m_s == 0.0

    def tilt_rad(self, relative_m_s: Array) -> float:
        """The tilt that opens the cup against the ball's velocity relative to it (along the line, up) (2,)."""
        most = self._catch.max_tilt_rad
        return min(max(math.atan2(-relative_m_s[0], -relative_m_s[1]), -most), most)

    def next(self, t_s: float, end_s: float, tilt_rad: float) -> CupTilt:
        """Tilt and lift at the end of the period that begins at ``t_s``, where the cup meets the ball at ``end_s``."""
        catch, h = self._catch, self._period_s
        tilt, turn = self._tilt
        lift, rise = self._lift
        if end_s - t_s > catch.settled_before_s:
            turning = _planned(tilt_rad - tilt, turn, 0.0, span=(t_s, end_s), limit=TILT_LIMIT_RAD_S2, h=h)
            rising = _planned(-lift, rise, -catch.give_m_s, span=(t_s, end_s), limit=catch.acceleration_m_s2, h=h)
            self._kept = turning, rising
        elif t_s < end_s:
            turning, rising = self._kept
        else:
            end_s = max(end_s + UPRIGHT_AFTER_S, t_s + 4 * h)
            turning = _planned(-tilt, turn, 0.0, span=(t_s, end_s), limit=TILT_LIMIT_RAD_S2, h=h)
            rising = min(max(-rise / h, -catch.give_braking_m_s2), catch.give_braking_m_s2)
        self._tilt = [tilt + (turn + 0.5 * turning * h) * h, turn + turning * h]
        self._lift = [lift + (rise + 0.5 * rising * h) * h, rise + rising * h]
        return CupTilt(*self._lift, *self._tilt)


def _planned(way: float, speed: float, wanted: float, *, span: tuple[float, float], limit: float, h: float) -> float:
    """The mean acceleration of the coming period ``h`` on the cubic over ``span``, from its begin to its end."""
    plan = plan_interception(
        way_m=way, velocity_m_s=speed, wanted_m_s=wanted, start_s=span[0], end_s=span[1], limit_m_s2=limit
    )
    return plan.acceleration_m_s2(span[0] + 0.5 * h)
