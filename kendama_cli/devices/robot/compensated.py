"""A robot whose commander adds the friction that the robot's own controller does not know."""

from __future__ import annotations

import dataclasses

from kendama_cli.artifacts.friction_model import FrictionModel
from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.errors import StageError
from kendama_cli.robot_model.friction import friction_torque
from kendama_cli.schema.arrays import Array


class CompensatedRobot:
    """``robot`` with the torque of ``friction`` at the commanded velocity added to every command.

    The velocity is the commanded one, which knows no noise and reverses when it should; so the torque changes sign as
    the joint does. Raises StageError where the model is for other joints.
    """

    def __init__(self, robot: Robot, friction: FrictionModel) -> None:
        if friction.joint_names != robot.joint_names:
            raise StageError(
                f"the friction model is for the joints {', '.join(friction.joint_names)}; this robot has "
                f"{', '.join(robot.joint_names)}: identify it again; nothing was moved"
            )
        self._robot = robot
        self._friction = friction
        self.joint_names = robot.joint_names
        self.limits = robot.limits
        self.period_s = robot.period_s
        self.realtime = robot.realtime
        self.torque = None  # friction is added to position commands only

    @property
    def missed(self) -> int:
        """The robot's own count."""
        return self._robot.missed

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period, with friction compensated; raises HardwareError as the robot does."""
        effort = command.effort_nm + friction_torque(self._friction, command.velocity_rad_s)
        return self._robot.exchange(dataclasses.replace(command, effort_nm=effort))

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Reset the robot."""
        return self._robot.reset(position_rad, seed)

    def halt(self) -> None:
        """Halt the robot."""
        self._robot.halt()

    def close(self) -> None:
        """Close the robot."""
        self._robot.close()


def compensated(robot: Robot, friction: FrictionModel | None) -> Robot:
    """Return ``robot``, compensated if there is a model."""
    return robot if friction is None else CompensatedRobot(robot, friction)
