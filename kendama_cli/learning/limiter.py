"""The braking limiter: what may be commanded so that the cup can still stop inside its workspace."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class BrakingLimiter:
    """Limits a commanded acceleration a so that |x| <= ``half_width_m`` and |v| <= ``max_speed_m_s`` keep holding.

    With an actuator that follows its command u by T a' = u - a (``lag_s`` = T), s = v + (a + largest) T obeys s' = u
    and x' <= s. With a deceleration b = ``braking_m_s2`` that can be counted on, x + s^2 / (2 b) <= half_width can
    therefore be kept by braking with u = -b; without a lag this is the double integrator's stopping parabola. The
    same holds to the left with x, v and a of opposite sign. A command whose next ``period_s`` would leave that set is
    lowered to the edge of it. What ``largest_m_s2`` has over b is the reserve against an actuator that brakes less
    than it is told. A pure delay is met by handing in the state expected at its end.
    """

    half_width_m: float
    max_speed_m_s: float
    braking_m_s2: float
    largest_m_s2: float
    period_s: float
    lag_s: float = 0.0

    def limit(self, command_m_s2: float, x_m: float, velocity_m_s: float, acceleration_m_s2: float = 0.0) -> float:
        """The acceleration nearest to ``command_m_s2`` that keeps the cup inside.

        ``acceleration_m_s2`` is the actuator's present acceleration; it matters only with a lag. Where a disturbance
        has left no such acceleration, the answer brakes with ``largest_m_s2``.
        """
        h, lag, largest = self.period_s, self.lag_s, self.largest_m_s2
        reached = velocity_m_s + acceleration_m_s2 * lag
        highest = min(self._highest(x_m, reached + largest * lag), (self.max_speed_m_s - reached) / h)
        lowest = -min(self._highest(-x_m, largest * lag - reached), (self.max_speed_m_s + reached) / h)
        if command_m_s2 > highest:
            return max(highest, -largest)
        return min(lowest, largest) if command_m_s2 < lowest else command_m_s2

    def _highest(self, x_m: float, stop_velocity_m_s: float) -> float:
        """Largest u with x + (s + u h) h + (s + u h)^2 / (2 b) <= half_width, less what a step within h can add."""
        b, h = self.braking_m_s2, self.period_s
        room = self.half_width_m - x_m - 0.5 * b * h * h
        reach = b * h * b * h + 2.0 * b * room
        if reach <= 0.0:
            return -self.largest_m_s2
        return (math.sqrt(reach) - b * h - stop_velocity_m_s) / h
