"""Braking on a line: what may be commanded so that the cup can still stop inside its workspace."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kendama_cli.schema.arrays import Array

BRAKING_SHARE = 0.9
"""Part of the maximum acceleration that braking counts on where the settings do not say; a tenth is in reserve."""


class BrakingLimiter(NamedTuple):
    """Limits of a commanded acceleration a so that |x| <= ``half_width_m`` and |v| <= ``max_speed_m_s`` keep holding.

    With a deceleration b = ``braking_m_s2`` that can be counted on, braking with -b keeps x + v^2 / (2 b) within
    half_width: the double integrator's stopping parabola. The same holds to the left with x and v of opposite sign. A
    command whose next ``period_s`` would leave that set is lowered to the edge of it. What ``max_m_s2`` has over b
    is the reserve against an actuator that brakes less than commanded. An actuator that follows late is met by handing
    in the state expected when the command takes effect.
    """

    half_width_m: float
    max_speed_m_s: float
    braking_m_s2: float
    max_m_s2: float
    period_s: float

    def limit(self, command_m_s2: float, x_m: float, velocity_m_s: float) -> float:
        """Return ``limited``."""
        return limited(self, command_m_s2, x_m, velocity_m_s)


def limited(limiter: BrakingLimiter, command_m_s2: float, x_m: float, velocity_m_s: float) -> float:
    """Return the acceleration nearest to ``command_m_s2`` that keeps the cup inside.

    Where a disturbance has left no such acceleration, the answer brakes with ``max_m_s2``.
    """
    h, maximum = limiter.period_s, limiter.max_m_s2
    highest = min(_highest(limiter, x_m, velocity_m_s), (limiter.max_speed_m_s - velocity_m_s) / h)
    lowest = -min(_highest(limiter, -x_m, -velocity_m_s), (limiter.max_speed_m_s + velocity_m_s) / h)
    if command_m_s2 > highest:
        return max(highest, -maximum)
    return min(lowest, maximum) if command_m_s2 < lowest else command_m_s2


def _highest(limiter: BrakingLimiter, x_m: float, velocity_m_s: float) -> float:
    """Return the maximum u with x + (v + u h) h + (v + u h)^2 / (2 b) <= half_width, less what a step in h can add."""
    b, h = limiter.braking_m_s2, limiter.period_s
    left_m = limiter.half_width_m - x_m - 0.5 * b * h * h
    reach = b * h * b * h + 2.0 * b * left_m
    if reach <= 0.0:
        return -limiter.max_m_s2
    return (math.sqrt(reach) - b * h - velocity_m_s) / h


def stoppable_m_s(braking_m_s2: float, left_m: Array) -> Array:
    """Return the speeds (n,) from which braking stops within ``left_m`` (n,): v^2 = 2 b d."""
    return np.asarray(np.sqrt(2 * braking_m_s2 * left_m))
