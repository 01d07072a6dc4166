"""A robot whose commands run ahead of the motion, by what its own servo is behind them."""

from __future__ import annotations

import numpy as np

from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot, WrappedRobot
from kendama_cli.errors import StageError
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.drive_kernel import POSITION, VELOCITY, Drive


class LeadingRobot(WrappedRobot):
    """``robot`` with every command led, so that the joints are where the commander wants them; unchanged without servo.

        u = p + T p' + s tau(p, p', p'') + c,  p = q + d q' + d^2 q'' / 2 + d^3 q''' / 6

    and its velocity u' = p' + T p'' and acceleration u'' = p'' + T q''' likewise, with q''' from the last two
    commanded accelerations. Where the robot's limits forbid u, what is sent follows it as they allow (Drive): a step
    of the acceleration is a peak in u, and what was cut of it is caught up with. ``servo`` may be given later, by
    ``lead``: at rest, before a ``reset``. ``arm`` computes the torques tau.
    """

    def __init__(self, robot: Robot, arm: RobotModel, servo: ServoModel | None = None) -> None:
        super().__init__(robot)
        self._arm = arm
        self._servo: ServoModel | None = None
        self._last: Array = np.zeros(len(robot.joint_names))
        self._drive = Drive(robot.limits, robot.period_s)
        self.lead(servo)

    @property
    def servo(self) -> ServoModel | None:
        """Servo that commands are led by; None where they pass as they are."""
        return self._servo

    def lead(self, servo: ServoModel | None) -> None:
        """Lead all commands by ``servo`` from now on; raises StageError where it is for other joints."""
        if servo is not None and servo.joint_names != self.joint_names:
            raise StageError(
                f"the servo model is for the joints {', '.join(servo.joint_names)}; this robot has "
                f"{', '.join(self.joint_names)}: identify it again; nothing was moved"
            )
        self._servo = None if servo is None or servo.follows else servo

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period, its command led; raises HardwareError as the robot does."""
        servo = self._servo
        if servo is None:
            return self._robot.exchange(command)
        dead_s, lag_s = servo.dead_time_s, servo.lag_s
        jerk = (command.acceleration_rad_s2 - self._last) / self.period_s
        self._last = command.acceleration_rad_s2
        taylor = np.array([1.0, dead_s, dead_s**2 / 2, dead_s**3 / 6])
        motion = np.array([command.position_rad, command.velocity_rad_s, command.acceleration_rad_s2, jerk])
        position, velocity, change = (taylor[: 4 - order] @ motion[order:] for order in range(3))
        ahead = position + lag_s * velocity + self._sag(servo, position, velocity, change)
        pushed = change + lag_s * jerk
        self._drive.follow(ahead, velocity + lag_s * change, pushed)
        position, velocity = self._drive.state[[POSITION, VELOCITY]]
        return self._robot.exchange(JointCommand(position, velocity, pushed, command.effort_nm))

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Reset the robot to where it rests at ``position_rad`` (n,) in spite of its sag."""
        self._last = np.zeros_like(self._last)
        if self._servo is None:
            return self._robot.reset(position_rad, seed)
        still = np.zeros_like(self._last)
        start = position_rad + self._sag(self._servo, position_rad, still, still)
        self._drive.reset(start)
        return self._robot.reset(start, seed)

    def _sag(self, servo: ServoModel, position: Array, velocity: Array, change: Array) -> Array:
        if not servo.sag_rad_nm.any():
            return servo.offset_rad
        effort_nm = self._arm.rigid_effort_nm(position, velocity, change)
        return np.asarray(servo.sag_rad_nm * effort_nm + servo.offset_rad)
