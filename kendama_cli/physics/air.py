"""The air's drag on the ball (equations.md eq. 1)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
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
