"""Cup off its line: tilted in the swing plane, and lower or higher, by differential inverse kinematics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.robot_model.inverse_kinematics import OutOfReachError, solve_cup, weighted_step
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class CupTilt:
    """Lift of the cup over its line, its tilt from upright toward the line's direction, and their rates."""

    lift_m: float = 0.0
    lift_m_s: float = 0.0
    tilt_rad: float = 0.0
    tilt_rad_s: float = 0.0


class TiltingArm:
    """Joint commands for the cup on its line and tilted, each found from the one before.

    Speeds solve J q' = v with the arm's own weights, and accelerations are their differences. ``direction`` (3,) is
    the line's, ``middle_m`` (3,) the tie point at x = 0.
    """

    def __init__(self, arm: RobotModel, middle_m: Array, direction: Array, period_s: float) -> None:
        self._arm, self._middle_m, self._direction, self._period_s = arm, middle_m, direction, period_s

    def begin(self, position_rad: Array, velocity_rad_s: Array) -> None:
        """Continue from this command, with the cup on its line."""
        self._q, self._speed = np.array(position_rad), np.array(velocity_rad_s)

    def at(self, x_m: float, velocity_m_s: float, tilt: CupTilt) -> JointCommand | None:
        """Return the joints for the end of the coming period; None if they would leave their limits."""
        arm, along = self._arm, self._direction
        up = np.array([0.0, 0.0, 1.0])
        place = self._middle_m + x_m * along + tilt.lift_m * up
        axis = math.sin(tilt.tilt_rad) * along + math.cos(tilt.tilt_rad) * up
        about = np.cross(up, along)
        turns = np.array([about, np.cross(axis, about)])  # the cup may spin about its axis
        try:
            q = solve_cup(arm, place, self._q, turns)
        except OutOfReachError:
            return None
        _, task = arm.cup_task(q, turns)
        desired = np.concatenate([velocity_m_s * along + tilt.lift_m_s * up, [tilt.tilt_rad_s, 0.0]])
        speed = weighted_step(task, desired, arm.redundancy_weights)
        change_rad_s2 = (speed - self._speed) / self._period_s
        if not arm.limits.allow(q, speed, change_rad_s2).all():
            return None
        self._q, self._speed = q, speed
        return JointCommand(q, speed, change_rad_s2)
