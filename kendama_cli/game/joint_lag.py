"""How far an arm's joints are behind what they are commanded."""

from __future__ import annotations

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.schema.arrays import Array

LONGEST_LAG_S = 0.1
LEAST_MOTION = 1e-3
"""Sum of squared speeds from which on something is known [rad^2/s^2]."""


class JointLag:
    """The slope of (commanded - read) angles over the commanded speeds, by least squares over all joints."""

    def __init__(self) -> None:
        self._behind = self._moved = 0.0

    def observe(self, command: JointCommand, position_rad: Array) -> None:
        """The joints are read at ``position_rad`` (n,) after ``command``."""
        self._behind += float(command.velocity_rad_s @ (command.position_rad - position_rad))
        self._moved += float(command.velocity_rad_s @ command.velocity_rad_s)

    @property
    def lag_s(self) -> float:
        """In [0, LONGEST_LAG_S]; 0 before they have moved [s]."""
        return min(max(self._behind / self._moved, 0.0), LONGEST_LAG_S) if self._moved > LEAST_MOTION else 0.0
