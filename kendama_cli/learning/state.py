"""The state that learning sees, and the half-swings counted from it, alike in simulation and on a robot."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class SwingState(NamedTuple):
    """Cup along x and ball about the tie point: angle 0 hanging, pi upright above, positive toward +x."""

    x_m: float
    velocity_m_s: float
    angle_rad: float
    rate_rad_s: float


TURN_RAD_S = 0.5
"""The ball's angular velocity from which it counts as swinging one way: a half-swing begins there."""


def swing_direction(rate_rad_s: float, before: int) -> int:
    """Return the direction of the ball's swing at ``rate_rad_s``: 1 or -1; ``before`` while it is slower than
    TURN_RAD_S.
    """
    if abs(rate_rad_s) > TURN_RAD_S:
        return 1 if rate_rad_s > 0.0 else -1
    return before


def count_half_swings(rates_rad_s: Iterable[float]) -> int:
    """Return the number of stretches in which the ball swings in one direction, the first and the last included.

    A ball that swings out from rest, turns once and reaches the goal made two half-swings; one at rest made none.
    """
    count = direction = 0
    for rate_rad_s in rates_rad_s:
        now = swing_direction(rate_rad_s, direction)
        count += now != direction
        direction = now
    return count
