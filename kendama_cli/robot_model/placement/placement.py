"""Joint motions for motions of the cup, with the cup upright throughout."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.errors import StageError
from kendama_cli.motion.even_spline import EvenSpline
from kendama_cli.robot_model.inverse_kinematics import follow_path
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings

LINE_STEP_M = 0.005
"""Knots of the line's table: the spline between them is within 1e-7 rad of the exact solution."""


@dataclass(frozen=True)
class JointPoint:
    """Joint angles, speeds and accelerations (n,) at one instant."""

    position_rad: Array
    velocity_rad_s: Array
    acceleration_rad_s2: Array


class CupLine:
    """The upright cup on a line along the world's x through the home posture; x = 0 is home.

    ``home_rad`` (n,) is the posture at x = 0 and ``home_m`` (3,) the tie point there.
    """

    def __init__(self, arm: RobotModel, half_width_m: float) -> None:
        self.half_width_m = half_width_m
        self.home_rad = arm.home_rad
        self.home_m = arm.tool_position_m(arm.home_rad)
        self._arm = arm

    @functools.cached_property
    def curve(self) -> EvenSpline:
        """Joint angles over x; solved when first asked for. Raises StageError where the arm cannot follow the line."""
        arm = self._arm
        count = math.ceil(self.half_width_m / LINE_STEP_M) + 1
        out = LINE_STEP_M * np.arange(count + 1)[:, None] * np.array([1.0, 0.0, 0.0])
        right = follow_path(arm, self.home_m + out, arm.home_rad)
        left = follow_path(arm, self.home_m - out, arm.home_rad)
        return EvenSpline(-LINE_STEP_M * count, LINE_STEP_M, np.vstack([left[:0:-1], right]))

    def at(self, x_m: float, velocity_m_s: float, acceleration_m_s2: float) -> JointPoint:
        """Return the joints with the cup at ``x_m`` from home, moving with the given velocity and acceleration along
        x.

            q' = q_x v,   q'' = q_x a + q_xx v^2

        Raises StageError outside +-``half_width_m`` (one knot's width is tolerated).
        """
        if not abs(x_m) <= self.half_width_m + LINE_STEP_M:
            raise StageError(f"the cup's line is asked for x = {x_m:.3f} m; allowed: +-{self.half_width_m:.3f} m")
        point = self.curve.at(x_m)
        speed = point.first * velocity_m_s
        return JointPoint(point.value, speed, point.first * acceleration_m_s2 + point.second * velocity_m_s**2)


def cup_line(robot: RobotSettings, game: GameSettings, half_width_m: float) -> CupLine:
    """Return the line of +-``half_width_m`` along x for this arm; raises StageError if the arm cannot follow it."""
    line = CupLine(RobotModel(robot, game.cup, game.gravity_m_s2), half_width_m)
    _ = line.curve
    return line


def joint_trajectory(arm: RobotModel, t_s: Array, cup_m: Array) -> JointTrajectory:
    """Return the arm's motion (n samples) for the tie point's motion ``cup_m`` (n, 3) relative to home, cup upright.

    ``t_s`` (n,) rises strictly, and the motion must be smooth on that grid: velocities and accelerations are those of
    the cubic spline through the joint angles. Raises StageError where the arm cannot reach (see follow_path).
    """
    angles = follow_path(arm, arm.tool_position_m(arm.home_rad) + np.asarray(cup_m), arm.home_rad, t_s)
    curve = CubicSpline(t_s, angles)
    return JointTrajectory(arm.joint_names, np.asarray(t_s), angles, curve(t_s, 1), curve(t_s, 2))
