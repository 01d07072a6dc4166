"""The ball in flight: the air's drag (equations.md eq. 1), and free fall to the rim's plane, without air."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar

from kendama_cli.physics.taut_rope import Ball
from kendama_cli.schema.arrays import Array

Numbers = TypeVar("Numbers", "float", "Array")
Vector = tuple[float, float, float]


def drag_over_speed(linear: float, quadratic: float, speed: Numbers) -> Numbers:
    """Return k1 + k2 |v|, a number or an array: the air's force against the motion over its speed [N s/m].

    The same of the force over the ball's mass [1/s], where k1 and k2 are.
    """
    return linear + quadratic * speed


def drag_n(linear_n_s_m: float, quadratic_n_s2_m2: float, velocity_m_s: Vector) -> Vector:
    """Return the air's force -(k1 + k2 |v|) v on a ball with ``velocity_m_s`` [N]."""
    x, y, z = velocity_m_s
    drag = drag_over_speed(linear_n_s_m, quadratic_n_s2_m2, math.sqrt(x * x + y * y + z * z))
    return -drag * x, -drag * y, -drag * z


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


def runge_kutta(slope: Callable[[Array], Array], state: Array, step_s: float) -> Array:
    """Return the solution of y' = ``slope``(y) at ``step_s`` after ``state`` (...), to step^5 (W. Kutta 1901)."""
    k1 = slope(state)
    k2 = slope(state + 0.5 * step_s * k1)
    k3 = slope(state + 0.5 * step_s * k2)
    k4 = slope(state + step_s * k3)
    return state + step_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
