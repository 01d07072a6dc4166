"""Errors of an arm: it lags behind its commands, and its cup is not quite in position."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.motion import minimum_jerk
from kendama_cli.robot_model.inverse_kinematics import weighted_step
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.drive_delay import DriveDelay

KNOT_S = 0.02
"""The cup's error is carried to the joints this often and interpolated between: eight times in a period of 6 Hz."""
ONSET_S = 0.3
"""The cup's error grows from nothing within this time, so that the arm begins at rest."""


@dataclass(frozen=True)
class ArmErrors:
    """Errors of one arm against its model: a lag of first order, and a slow error of the cup along the world's x.

    e(t) = cup_error_m sin(2 pi cup_error_hz t + cup_error_phase_rad),   grown from nothing within ONSET_S
    """

    lag_s: float = 0.0
    cup_error_m: float = 0.0
    cup_error_hz: float = 1.0
    cup_error_phase_rad: float = 0.0


class ErringArm:
    """Reference of an erring drive in the place of the samples of ``joints``, or of commands in their place.

    The cup's error is carried to the joints along ``joints``: dq = J^+ e, the cup's tilt as it is. It is no command,
    so that the drive's limits do not bound it; the angles are misread by as much as makes the arm err by dq.
    """

    def __init__(self, arm: RobotModel, joints: JointTrajectory, errors: ArmErrors, step_s: float) -> None:
        start = joints.position_rad[0]
        rest = np.zeros_like(start)
        self._delay = DriveDelay((start, rest, rest, rest), latency_s=0.0, lag_s=errors.lag_s, step_s=step_s)
        self._none = rest
        self._misread = _misread(arm, joints, errors) if errors.cup_error_m > 0 else None

    def follows(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """Return the reference (n,) of positions, velocities and accelerations at the next sample."""
        position, velocity, acceleration, _ = self._delay.delayed((position, velocity, acceleration, self._none))
        return position, velocity, acceleration

    def misreads(self, step: int) -> Array:
        """Return the reading error (n,) of the angles for the drive's controller before the sample ``step``."""
        misread: Array = self._none if self._misread is None else self._misread[step - 1]
        return misread


def _misread(arm: RobotModel, joints: JointTrajectory, errors: ArmErrors) -> Array:
    """Return the reading errors (n, joints) by which computed torque deviates by dq from its reference.

    dq'' + Kd dq' + Kp (dq + m) = 0,   m = -dq - (Kd dq' + dq'') / Kp,   Kd = 2 sqrt Kp
    """
    place, speed, change = _joint_offsets(arm, joints, errors)
    stiffness = arm.settings.stiffness_1_s2
    return -place - (2 * math.sqrt(stiffness) * speed + change) / stiffness


def _joint_offsets(arm: RobotModel, joints: JointTrajectory, errors: ArmErrors) -> tuple[Array, Array, Array]:
    """Return the joint offsets (n, joints) with their first two derivatives at every sample of ``joints``."""
    t_s = joints.t_s - joints.t_s[0]
    every = max(1, round(KNOT_S / float(t_s[1] - t_s[0])))
    knots = np.append(np.arange(0, len(t_s) - 1, every), len(t_s) - 1)
    turned = 2 * math.pi * errors.cup_error_hz * t_s[knots] + errors.cup_error_phase_rad
    error_m = errors.cup_error_m * minimum_jerk.step(t_s[knots] / ONSET_S) * np.sin(turned)
    aside = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    offsets = [
        weighted_step(arm.tool_jacobian(joints.position_rad[k]), e * aside, arm.redundancy_weights)
        for k, e in zip(knots, error_m, strict=True)
    ]
    curve = CubicSpline(t_s[knots], np.array(offsets))
    return curve(t_s), curve(t_s, 1), curve(t_s, 2)
