"""Fitting a planned swing to the rope that hangs from the real cup."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.devices.robot.interface import JointCommand, Robot
from kendama_cli.errors import StageError
from kendama_cli.game.imitation import require_same_joints
from kendama_cli.robot_model.inverse_kinematics import follow_path
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.placement.limit_shares import require_within_limits

MEASURED_PERIODS = 100
"""Control periods at rest over which the hanging ball is observed."""
KNOT_S = 0.004
"""Spacing of the solved postures, as in kendama_cli/simulation/catch/arm_motion.py."""
RAMP = 20
"""Steps from home to the first posture."""


def measured_rope_m(robot: Robot, posture_rad: Array, game: GameSettings, seed: int) -> float:
    """The untensioned rope from the tracked ball while it hangs at rest: mean distance less m g / Ks.

    Raises HardwareError of the line.
    """
    robot.reset(posture_rad, seed)
    rest = np.zeros(len(posture_rad))
    lengths = []
    for _ in range(MEASURED_PERIODS):
        state = robot.exchange(JointCommand(posture_rad, rest, rest)).state
        lengths.append(float(np.linalg.norm(state.ball_in_world_m - state.cup_in_world_m)))
    return float(np.mean(lengths)) - game.ball.mass_kg * game.gravity_m_s2 / game.rope.stiffness_n_m


def resized(arm: RobotModel, motion: JointTrajectory, scale: float) -> JointTrajectory:
    """The same swing of the cup for a rope ``scale`` times as long.

    A pendulum with all lengths times s and all times times sqrt(s) obeys the same equations of motion under the same
    gravity, so that the path is made s times as large and sqrt(s) times as slow. Raises StageError where the arm
    cannot follow within its limits.
    """
    thin = max(1, round(KNOT_S / float(np.diff(motion.t_s).mean())))
    t_s = motion.t_s[::thin]
    home_m = arm.tool_place_m(arm.home_rad)
    cup_m = scale * (np.array([arm.tool_place_m(posture) for posture in motion.position_rad[::thin]]) - home_m)
    start = follow_path(arm, home_m + np.linspace(0.0, 1.0, RAMP)[:, None] * cup_m[0], arm.home_rad)[-1]
    angles = follow_path(arm, home_m + cup_m, start)
    t_s = t_s * math.sqrt(scale)
    curve = CubicSpline(t_s, angles)
    joints = JointTrajectory(motion.joint_names, t_s, angles, curve(t_s, 1), curve(t_s, 2))
    require_within_limits(arm, joints)
    return joints


@dataclass(frozen=True)
class FittedMotion:
    """A motion for the rope at hand: ``rope_scale`` times the model's; ``joints`` is as planned unless ``resized``."""

    joints: JointTrajectory
    rope_scale: float
    resized: bool


def fitted(robot: Robot, arm: RobotModel, motion: JointTrajectory, game: GameSettings, seed: int) -> FittedMotion:
    """``motion`` for the rope that is measured on ``robot``; as planned where the arm cannot follow the fitted one.

    Raises StageError, before anything moves, where the motion was made for other joints; HardwareError of the line.
    """
    require_same_joints(robot, motion)
    scale = measured_rope_m(robot, motion.position_rad[0], game, seed) / game.rope.length_m
    try:
        return FittedMotion(resized(arm, motion, scale), scale, resized=True)
    except StageError:
        return FittedMotion(motion, scale, resized=False)
