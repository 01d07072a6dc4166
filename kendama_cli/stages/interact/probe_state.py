"""What a task-space controller knows of the arm: by the robot's sensors and the robot model alone."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.devices.robot.interface import Robot, RobotState
from kendama_cli.errors import StageError
from kendama_cli.motion.impedance import TaskState
from kendama_cli.motion.task_settings import InteractSettings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.task_state import task_state


class ProbeState:
    """The arm with its probe after the last reading, ``state`` at ``t_s``.

    The contact's force is what the wrist's sensor reads, less the probe's weight, F = m g - R f (f being what the probe
    exerts on the tip link, in its frame), through a filter of first order and ``sensor_hz``; the probe's inertia is in.
    """

    state: TaskState
    t_s: float

    def __init__(self, robot: RobotSettings, interact: InteractSettings, period_s: float) -> None:
        self._model = RobotModel(robot, interact.probe, interact.gravity_m_s2)
        self._body = self._model.new_body()
        self._weight_n = interact.probe.mass_kg * np.array([0.0, 0.0, -interact.gravity_m_s2])
        self._share = 1.0 - math.exp(-2.0 * math.pi * interact.sensor_hz * period_s)
        self._felt_n = np.zeros(3)
        self.home_rad = self._model.home_rad

    def check_joints(self, robot: Robot) -> None:
        """Raise StageError, before anything moves, where ``robot`` has other joints than the model."""
        if robot.joint_names != self._model.joint_names:
            raise StageError(
                f"the robot has the joints {', '.join(robot.joint_names)}, the configured arm "
                f"{', '.join(self._model.joint_names)}: choose the robot's own description (robot=...); nothing moved"
            )

    def take(self, reading: RobotState, t_s: float) -> None:
        """Take the robot's reading at ``t_s``; the one at time 0 begins the filter at no contact."""
        skeleton = self._body.skeleton
        skeleton.setPositions(reading.position_rad)
        skeleton.setVelocities(reading.velocity_rad_s)
        turn = np.array(self._body.tip.getWorldTransform().rotation())
        felt_n = self._weight_n - turn @ reading.wrist_wrench[:3]
        self._felt_n = np.zeros(3) if t_s == 0 else self._felt_n + self._share * (felt_n - self._felt_n)
        self.state, self.t_s = task_state(self._body, self._felt_n), t_s
