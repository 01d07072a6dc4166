"""The limits of an arm's joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array, set_arrays


@dataclass(frozen=True)
class JointLimits:
    """Limits of n joints; every array is (n,)."""

    lower_rad: Array
    upper_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array
    effort_nm: Array

    def __post_init__(self) -> None:
        names = "lower_rad", "upper_rad", "velocity_rad_s", "acceleration_rad_s2", "effort_nm"
        set_arrays(self, **dict.fromkeys(names, (len(self.lower_rad),)))

    def to_stop_rad(self, position_rad: Array) -> Array:
        """Return how far ``position_rad`` (..., n) is from the nearer stop (..., n) [rad]; negative beyond it."""
        return np.asarray(np.minimum(position_rad - self.lower_rad, self.upper_rad - position_rad))

    def allow(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array) -> NDArray[np.bool_]:
        """Return True for each joint (n,) that keeps to its stops and its limits of velocity and acceleration."""
        inside = self.to_stop_rad(position_rad) >= 0
        inside &= np.abs(velocity_rad_s) <= self.velocity_rad_s
        return np.asarray(inside & (np.abs(acceleration_rad_s2) <= self.acceleration_rad_s2))
