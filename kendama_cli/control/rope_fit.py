"""Fitting a planned swing to the rope that hangs from the real cup."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.adaptation.settings import CorrectionSettings
from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory, MotionPlan
from kendama_cli.control.imitation import require_same_joints
from kendama_cli.control.reachable import Surroundings, follow_from_s
from kendama_cli.devices.robot.interface import JointCommand, Robot
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.amplitude import scaled_plan
from kendama_cli.physics.taut_rope import stretch_m, time_scale
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.limit_shares import require_within_limits
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

MEASURED_PERIODS = 100
"""Control periods at rest over which the hanging ball is observed."""


def measured_rope_m(robot: Robot, posture_rad: Array, game: GameSettings, seed: int) -> float:
    """The untensioned rope from the tracked ball while it hangs at rest: mean distance less m g / Ks.

    Raises HardwareError of the line.
    """
    robot.reset(posture_rad, seed)
    rest = np.zeros(len(posture_rad))
    lengths = []
    for _ in range(MEASURED_PERIODS):
        state = robot.exchange(JointCommand(posture_rad, rest, rest)).state
        down_m = state.cup_in_world_m - state.ball_in_world_m
        lengths.append(float(np.linalg.norm(down_m)))
    return float(np.mean(lengths)) - stretch_m(game.ball.mass_kg * game.gravity_m_s2, game.rope.stiffness_n_m)


def scaled_motion(
    arm: RobotModel, plan: MotionPlan, scale: float, *, lead_in_m_s2: float, hold_s: float
) -> JointTrajectory:
    """The arm's motion for the swing of ``plan`` on a rope ``scale`` times as long; at scale 1 it ends with ``hold_s``.

    A pendulum with all lengths times s and all times times sqrt(s) obeys the same equations of motion under the same
    gravity, so that the primitive is made s times as large and sqrt(s) times as slow. At tau_scale 1 its lead-in takes
    as long as before: ``lead_in_m_s2`` grows with the path. Raises StageError where the arm cannot follow within its
    limits.
    """
    longer = scaled_plan(plan, scale, plan.tau_scale * time_scale(scale))
    joints = ArmMotion(arm, longer, scale * lead_in_m_s2).joints(longer.tau_scale, hold_s * time_scale(scale))
    require_within_limits(arm, joints)
    return joints


@dataclass(frozen=True)
class FittedMotion:
    """A motion for the rope at hand: ``rope_scale`` times the model's; ``joints`` is as planned unless ``resized``.

    ``steering`` keeps a seen catch to what was found safe about it.
    """

    joints: JointTrajectory
    steering: CorrectionSettings
    rope_scale: float
    resized: bool


def fitted(robot: Robot, motion: CatchMotion, around: Surroundings, *, seed: int) -> FittedMotion:
    """``motion`` for the rope that is measured on ``robot``; as planned where the scaled one is beyond arm or safety.

    The settings ``around`` it say how its joints were made from its plan. Raises StageError where it was made for other
    joints, before anything moves, or where it is not safe as planned; HardwareError of the line.
    """
    require_same_joints(robot, motion.joints)
    game, adapt = around.game, around.adapt
    scale = measured_rope_m(robot, motion.joints.position_rad[0], game, seed) / game.rope.length_m
    try:
        joints = scaled_motion(around.arm, motion.plan, scale, lead_in_m_s2=adapt.lead_in_m_s2, hold_s=adapt.hold_s)
        steering, _ = around.steering(joints, follow_from_s(motion))
    except StageError:
        steering, _ = around.steering(motion.joints, follow_from_s(motion))
        return FittedMotion(motion.joints, steering, scale, resized=False)
    return FittedMotion(joints, steering, scale, resized=True)
