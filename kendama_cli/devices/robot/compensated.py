"""A robot whose commander adds the friction that the robot's own controller does not know."""

from __future__ import annotations

import dataclasses

from kendama_cli.artifacts.friction_model import FrictionModel
from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot, WrappedRobot
from kendama_cli.errors import StageError
from kendama_cli.robot_model.friction import friction_torque


class CompensatedRobot(WrappedRobot):
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
        super().__init__(robot)
        self._friction = friction

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period, with friction compensated; raises HardwareError as the robot does."""
        effort = command.effort_nm + friction_torque(self._friction, command.velocity_rad_s)
        return self._robot.exchange(dataclasses.replace(command, effort_nm=effort))


def compensated(robot: Robot, friction: FrictionModel | None) -> Robot:
    """Return ``robot``, compensated if there is a model."""
    return robot if friction is None else CompensatedRobot(robot, friction)
