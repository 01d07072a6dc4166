"""The plain state that learning sees: four numbers, whatever they were measured or simulated with."""

from __future__ import annotations

from typing import NamedTuple


class SwingState(NamedTuple):
    """Cup along x and ball about the tie point: angle 0 hanging, pi upright above, positive toward +x."""

    x_m: float
    velocity_m_s: float
    angle_rad: float
    rate_rad_s: float
