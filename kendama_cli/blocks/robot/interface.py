"""What every robot offers, simulated, remote or real."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from kendama_cli.artifacts.checks import Array, array


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


@dataclass(frozen=True)
class JointCommand:
    """The wanted state of n joints at the end of the coming control period; every array is (n,)."""

    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array


@dataclass(frozen=True)
class RobotState:
    """What the robot's sensors tell; arrays are (n,).

    ``ball_in_world_m`` and ``cup_in_world_m`` (3,) come from the robot's own tracking (a twin's noisy marker, a real
    laboratory's motion capture); ``cup_in_world_m`` is the rope's tie point. ``caught`` is the cup's ball sensor.
    """

    position_rad: Array
    velocity_rad_s: Array
    effort_nm: Array
    cup_in_world_m: Array
    ball_in_world_m: Array
    caught: bool


@dataclass(frozen=True)
class Exchange:
    """One control period: the command that was really carried out after all limits, the state after it, its time."""

    sent: JointCommand
    state: RobotState
    t_s: float


class Robot(Protocol):
    """An arm that holds the cup; one call of ``exchange`` is one control period."""

    joint_names: tuple[str, ...]
    limits: JointLimits
    period_s: float

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period; raises HardwareError when the line or the robot has failed."""

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Bring the arm to rest at ``position_rad`` with the ball hanging still, for the next rollout.

        A simulated robot jumps there and draws its noise from ``seed``; a real one moves there slowly.
        """

    def halt(self) -> None:
        """Stop and stay stopped; idempotent, safe from any state."""

    def close(self) -> None:
        """Halt and let go of the device."""
