"""The limits of an arm's joints."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.arrays import Array, array


@dataclass(frozen=True)
class JointLimits:
    """Limits of n joints; every array is (n,)."""

    lower_rad: Array
    upper_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array
    effort_nm: Array

    def __post_init__(self) -> None:
        n = len(self.lower_rad)
        for name in ("lower_rad", "upper_rad", "velocity_rad_s", "acceleration_rad_s2", "effort_nm"):
            object.__setattr__(self, name, array(name, getattr(self, name), (n,)))
