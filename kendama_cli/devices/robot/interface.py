"""Interface of every robot, simulated, remote or real."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array, set_arrays


@dataclass(frozen=True)
class JointCommand:
    """The desired state of n joints at the end of the coming control period; every array is (n,).

    ``effort_nm`` is added to what the robot's own controller commands: what the commander knows and the controller
    does not, identified friction say. Left out it is zero.
    """

    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array
    effort_nm: Array = field(default_factory=lambda: np.zeros(()))

    def __post_init__(self) -> None:
        if np.ndim(self.effort_nm) == 0:
            object.__setattr__(self, "effort_nm", np.full(np.shape(self.position_rad), float(self.effort_nm)))


@dataclass(frozen=True)
class RobotState:
    """Measurements of the robot's sensors; arrays are (n,).

    ``ball_in_world_m`` and ``cup_in_world_m`` (3,) come from the robot's own tracking (a twin's noisy marker, a real
    laboratory's motion capture); ``cup_in_world_m`` is the rope's tie point. ``caught`` is the cup's ball sensor.
    ``wrist_wrench`` (6,) is the force-torque sensor between tip link and tool: force [N], then torque [Nm], that the
    tool exerts on the tip link, in that link's frame at its origin. ``effort_nm`` is the motors' torque, and
    ``external_nm`` what of it the robot itself takes for a push from outside; None for a robot that does not estimate.
    """

    position_rad: Array
    velocity_rad_s: Array
    effort_nm: Array
    wrist_wrench: Array
    cup_in_world_m: Array
    ball_in_world_m: Array
    caught: bool
    external_nm: Array | None = None


@dataclass(frozen=True)
class SceneState:
    """True state of the scene, as light would show it. It is for virtual cameras and for nobody else.

    ``position_rad`` (n,) are the true joint angles, ``cup_m`` (3,) is the tie point, ``cup_rotation`` (3, 3) has the
    cup's axes as its columns, ``ball_m`` (3,) is the ball's centre; all in the world frame.
    """

    position_rad: Array
    cup_m: Array
    cup_rotation: Array
    ball_m: Array

    def __post_init__(self) -> None:
        set_arrays(self, position_rad=(len(self.position_rad),), cup_m=(3,), cup_rotation=(3, 3), ball_m=(3,))


@dataclass(frozen=True)
class Exchange:
    """One control period: the command that was really carried out after all limits, the state after it, its time.

    Only a simulated robot reports the ``scene``; a real one is seen by real cameras.
    """

    sent: JointCommand
    state: RobotState
    t_s: float
    scene: SceneState | None = None


class Robot(Protocol):
    """An arm that holds the cup; one call of ``exchange`` is one control period.

    ``realtime``: its time runs by itself, and a late command is missed; otherwise it waits.
    """

    joint_names: tuple[str, ...]
    limits: JointLimits
    period_s: float
    realtime: bool

    @property
    def missed(self) -> int:
        """The control periods so far in which no command had come in time."""

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period; raises HardwareError when the line or the robot has failed."""

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Bring the arm to rest at ``position_rad`` with the ball hanging still, for the next rollout.

        A simulated robot jumps there and draws its noise from ``seed``; a real one moves there slowly.
        """

    def halt(self) -> None:
        """Stop and stay stopped; idempotent, safe from any state."""

    def close(self) -> None:
        """Halt and close the device."""


class WrappedRobot:
    """Robot that passes everything on to another one; a subclass changes what it is for."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.joint_names, self.limits, self.period_s = robot.joint_names, robot.limits, robot.period_s
        self.realtime = robot.realtime

    @property
    def missed(self) -> int:
        """Count of the robot itself."""
        return self._robot.missed

    def exchange(self, command: JointCommand) -> Exchange:
        """Exchange one control period; raises HardwareError as the robot does."""
        return self._robot.exchange(command)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Reset the robot."""
        return self._robot.reset(position_rad, seed)

    def halt(self) -> None:
        """Halt the robot."""
        self._robot.halt()

    def close(self) -> None:
        """Close the robot."""
        self._robot.close()


@runtime_checkable
class RecoverableRobot(Protocol):
    """A robot whose controller keeps a stop, a reflex say, until 'kendama robot recover'."""

    def recover(self) -> None:
        """Leave the stop without moving; raises HardwareError where that is refused."""
