"""Free fall to the rim's plane, and what takes the cup there. The air, which moves a landing by millimetres, is out."""

from __future__ import annotations

import math
from typing import NamedTuple

from kendama_cli.physics.taut_rope import Ball


class Landing(NamedTuple):
    """Landing of the ball in the rim plane: position, time, and the constant acceleration that takes the cup there.

    Without a landing ``time_s`` is 0 or less.
    """

    time_s: float
    x_m: float
    acceleration_m_s2: float


def fall_s(above_m: float, rising_m_s: float, gravity_m_s2: float) -> float:
    """Return when a ball ``above_m`` over a plane comes down through it; -inf where it does not rise over it.

    t = (v + sqrt(v^2 + 2 g h)) / g
    """
    root = rising_m_s * rising_m_s + 2.0 * gravity_m_s2 * above_m
    return -math.inf if root <= 0.0 else (rising_m_s + math.sqrt(root)) / gravity_m_s2


def landing(x_m: float, velocity_m_s: float, ball: Ball, rim_m: float, gravity_m_s2: float) -> Landing:
    """Return the landing of a ball that is wherever ``ball`` says from a cup at ``x_m`` with ``velocity_m_s``.

    The ball is d = d0 + d' t beside a cup that does not accelerate; a = 2 d / t^2 takes the cup there.
    """
    time_s = fall_s(ball.above_m - rim_m, ball.above_m_s, gravity_m_s2)
    if time_s <= 0.0:
        return Landing(time_s, x_m, 0.0)
    apart = ball.across_m + ball.across_m_s * time_s
    return Landing(time_s, x_m + velocity_m_s * time_s + apart, 2.0 * apart / (time_s * time_s))
