"""Motions played on an arm with what was measured, and the tracking error of its cup on a circle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.errors import StageError
from kendama_cli.motion import minimum_jerk
from kendama_cli.plugins.identification.settings import IdentifySettings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.motion_check import limit_ratios
from kendama_cli.robot_model.placement.placement import joint_trajectory
from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class JointRecording:
    """k control periods of n joints: time (k,), angles, speeds and efforts (k, n), wrist wrenches (k, 6).

    ``sent_rad`` (k, n) are the angles as commanded after all limits.
    """

    t_s: Array
    sent_rad: Array
    position_rad: Array
    velocity_rad_s: Array
    effort_nm: Array
    wrist_wrench: Array


def play(robot: Robot, motion: JointTrajectory, seed: int) -> JointRecording:
    """Play ``motion``, sampled at the control period of ``robot``, from rest at its first posture; return the
    recording.

    Raises StageError, before anything moves, where the robot has other joints, HardwareError of the line.
    """
    if motion.joint_names != robot.joint_names:
        raise StageError(
            f"the robot has the joints {', '.join(robot.joint_names)}, the configured arm "
            f"{', '.join(motion.joint_names)}: choose the robot's own description (robot=...); nothing was moved"
        )
    exchanges = [robot.reset(motion.position_rad[0], seed)]
    rows = zip(motion.position_rad[1:], motion.velocity_rad_s[1:], motion.acceleration_rad_s2[1:], strict=True)
    exchanges += [robot.exchange(JointCommand(*row)) for row in rows]
    return recorded(exchanges)


def recorded(exchanges: Sequence[Exchange]) -> JointRecording:
    """Return the sensors' readings in these control periods."""
    states = [exchange.state for exchange in exchanges]
    return JointRecording(
        np.array([exchange.t_s for exchange in exchanges]),
        np.array([exchange.sent.position_rad for exchange in exchanges]),
        np.array([state.position_rad for state in states]),
        np.array([state.velocity_rad_s for state in states]),
        np.array([state.effort_nm for state in states]),
        np.array([state.wrist_wrench for state in states]),
    )


RAMP_S = 0.5
"""The cup comes up to its speed, and to rest again, in so long."""
LONGEST_DELAY_S = 0.1
TRIES, MARGIN = 8, 0.98


@dataclass(frozen=True)
class Circle:
    """A motion of the cup on a circle: the joints' motion, and the speed that it reaches [m/s]."""

    joints: JointTrajectory
    speed_m_s: float


def circle(arm: RobotModel, settings: IdentifySettings, period_s: float) -> Circle:
    """Return the upright cup's circle that touches home from above; it is slower than the reference if a limit
    requires it.

    Raises StageError where the circle is outside the workspace.
    """
    speed = settings.tracking_speed_m_s
    for _ in range(TRIES):
        joints = joint_trajectory(arm, *_path(settings, speed, period_s))
        fraction = limit_ratios(arm, joints).leading[0].ratio
        if fraction <= 1:
            return Circle(joints, speed)
        speed *= MARGIN / min(fraction, 2.0)
    raise StageError(
        f"the circle of {settings.tracking_radius_m} m cannot be kept within the limits of {arm.settings.name} even at "
        f"{speed:.2f} m/s: lower identify.tracking_radius_m"
    )


def _path(settings: IdentifySettings, speed_m_s: float, period_s: float) -> tuple[Array, Array]:
    radius = settings.tracking_radius_m
    steady_s = 2 * np.pi * radius * settings.tracking_laps / speed_m_s
    t_s = np.arange(round((steady_s + 2 * RAMP_S) / period_s) + 1, dtype=np.float64) * period_s
    ending = (t_s - RAMP_S - steady_s) / RAMP_S
    seconds = RAMP_S * (
        minimum_jerk.step_integral(t_s / RAMP_S) + np.clip(ending, 0.0, 1.0) - minimum_jerk.step_integral(ending)
    )
    angle = speed_m_s / radius * (seconds + np.clip(t_s - RAMP_S, 0.0, steady_s))
    return t_s, radius * np.column_stack([np.sin(angle), np.zeros(len(t_s)), 1 - np.cos(angle)])


class TrackedPath:
    """Reference positions of the cup and its positions by the joints' readings, at full speed; each (k, 3) [m]."""

    def __init__(self, arm: RobotModel, motion: JointTrajectory, recording: JointRecording) -> None:
        self.t_s = motion.t_s
        self.wanted_m = np.array([arm.tool_position_m(row) for row in motion.position_rad])
        self.reached_m = np.array([arm.tool_position_m(row) for row in recording.position_rad])
        self._steady = (self.t_s >= RAMP_S + LONGEST_DELAY_S) & (self.t_s <= self.t_s[-1] - RAMP_S)
        self._curve = CubicSpline(self.t_s, self.wanted_m)

    def rms_m(self, delay_s: float) -> float:
        """Return the root mean square distance from the reference position ``delay_s`` before."""
        miss = self.reached_m - self._curve(self.t_s - delay_s)
        return float(np.sqrt((miss[self._steady] ** 2).sum(axis=1).mean()))

    def delay_s(self) -> float:
        """Return the delay of the drive: the one that minimises ``rms_m``."""
        return float(minimize_scalar(self.rms_m, bounds=(-0.01, LONGEST_DELAY_S), method="bounded").x)
