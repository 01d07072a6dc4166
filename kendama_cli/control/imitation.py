"""Imitation on the robot: a planned motion fitted to the real rope, corrected by what is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.adaptation.settings import CorrectionSettings
from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory, MotionPlan
from kendama_cli.control.catch_game import sensed_catch
from kendama_cli.control.corrected_motion import CorrectedMotion, CupPlan
from kendama_cli.control.flight_observer import WatchedFlight
from kendama_cli.control.reachable import Surroundings, follow_from_s
from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.heading import scaled_plan
from kendama_cli.motion.sampling import columns_at
from kendama_cli.physics.rim_crossing import SampledWays, catch_from_s
from kendama_cli.physics.taut_rope import stretch_m, time_scale
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.motion_check import require_within_limits
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

SETTLE_S = 0.6
"""The last posture is held so long: a ball that is still in the cup then is caught."""


@dataclass(frozen=True)
class Played:
    """Control periods of the robot, from rest at the first posture, and the ``joints`` that were planned."""

    exchanges: tuple[Exchange, ...]
    joints: JointTrajectory

    def caught(self, arm: RobotModel, game: GameSettings) -> bool:
        """Return True if the ball was caught, as in RolloutResult, by the cup's sensor and the tracked ball."""
        return sensed_catch(self.exchanges[-1].state.caught, self.miss_m(arm, game), game)

    def miss_m(self, arm: RobotModel, game: GameSettings, *, from_plan: bool = False) -> tuple[float, float] | None:
        """Return x and y of the ball beside the cup's axis in the descent next to the planned catch; None without one.

        Cup and ball are as tracked; ``from_plan``: the cup is where it was planned to be, which a visual catch left.
        """
        states = [one.state for one in self.exchanges]
        planned = np.array([arm.tool_position_m(position) for position in self.joints.position_rad])
        poses = [arm.tool_pose(state.position_rad) for state in states]
        t_s = np.array([one.t_s for one in self.exchanges]) - self.exchanges[0].t_s
        cup_m = np.array([state.cup_in_world_m for state in states])
        axes = np.array([pose.rotation[:, 2] for pose in poses])
        if from_plan:
            cup_m[1:] += planned - np.array([pose.position_m for pose in poses[1:]])
            axes[1:] = [arm.tool_pose(position).rotation[:, 2] for position in self.joints.position_rad]
        paths = SampledWays(t_s, cup_m, axes, np.array([state.ball_in_world_m for state in states]))
        return paths.miss_m(game, catch_from_s(self.joints.t_s, planned), game.rope.length_m)

    @property
    def apex_m(self) -> float:
        """Maximum height of the tracked ball over the cup."""
        return max(float(one.state.ball_in_world_m[2] - one.state.cup_in_world_m[2]) for one in self.exchanges)


@dataclass(frozen=True)
class VisualImitation:
    """Visual feedback of an imitation: the observer of the ball, the arm's model, and the correction of the plan.

    It begins at ``from_s``, at the tau of the plan.
    """

    watched: WatchedFlight
    arm: RobotModel
    correction: CorrectionSettings
    rim_m: float
    from_s: float


def play_motion(
    robot: Robot, motion: JointTrajectory, *, tau_scale: float, seed: int, seen: VisualImitation | None = None
) -> Played:
    """Play ``motion`` with its time stretched by ``tau_scale``, from rest, and hold its end.

    q(t / tau_scale), with velocities divided by tau_scale and accelerations by its square; if it is ``seen``, the cup
    goes to where the flying ball is seen to come down. Raises StageError if the motion was made for other joints,
    HardwareError of the line.
    """
    require_same_joints(robot, motion)
    exchanges = [robot.reset(motion.position_rad[0], seed)]
    played = stretched(motion, tau_scale, robot.period_s)
    if seen is None:
        for row in zip(played.position_rad, played.velocity_rad_s, played.acceleration_rad_s2, strict=True):
            exchanges.append(robot.exchange(JointCommand(*row)))
        return Played(tuple(exchanges), played)
    plan = CupPlan(seen.arm, _from_rest(played, motion.position_rad[0]), robot.period_s)
    corrected = CorrectedMotion(plan, seen.correction, seen.rim_m, tau_scale * seen.from_s)
    seen.watched.begin(exchanges[0], seed)
    for _ in played.t_s:
        exchanges.append(robot.exchange(corrected.next()))
        corrected.observe(exchanges[-1].state.position_rad)
        prediction = None if corrected.over else seen.watched.look(exchanges[-1])
        if prediction is not None:
            corrected.follow(prediction.catch)
    return Played(tuple(exchanges), played)


def _from_rest(played: JointTrajectory, start_rad: Array) -> JointTrajectory:
    """Return ``played`` with rest in ``start_rad`` (n,) before its first command."""
    rest = np.zeros((1, len(played.joint_names)))
    return JointTrajectory(
        played.joint_names,
        np.concatenate([[0.0], played.t_s]),
        np.vstack([start_rad, played.position_rad]),
        np.vstack([rest, played.velocity_rad_s]),
        np.vstack([rest, played.acceleration_rad_s2]),
    )


def stretched(motion: JointTrajectory, tau_scale: float, period_s: float) -> JointTrajectory:
    """Return ``motion`` stretched in time by ``tau_scale``, at the end of every control period, and its end held."""
    planned_s = motion.t_s - motion.t_s[0]
    ends_s = np.arange(1, round((planned_s[-1] * tau_scale + SETTLE_S) / period_s) + 1) * period_s
    t_s = ends_s / tau_scale
    moving = (t_s <= planned_s[-1])[:, None]
    position, velocity, acceleration = (
        columns_at(t_s, planned_s, values)
        for values in (motion.position_rad, motion.velocity_rad_s, motion.acceleration_rad_s2)
    )
    velocity = np.where(moving, velocity / tau_scale, 0.0)
    acceleration = np.where(moving, acceleration / tau_scale**2, 0.0)
    return JointTrajectory(motion.joint_names, ends_s, position, velocity, acceleration)


def require_same_joints(robot: Robot, motion: JointTrajectory) -> None:
    """Raise StageError where ``motion`` was made for other joints than ``robot`` has."""
    if motion.joint_names != robot.joint_names:
        raise StageError(
            f"the imitation motion is for the joints {', '.join(motion.joint_names)}; this robot has "
            f"{', '.join(robot.joint_names)}; nothing was moved"
        )


MEASURED_PERIODS = 100
"""Control periods at rest over which the hanging ball is observed."""


def measured_rope_m(robot: Robot, posture_rad: Array, game: GameSettings, seed: int) -> float:
    """Return the untensioned length of the rope from the tracked ball at rest: mean distance less m g / Ks.

    Where the robot does not tell where the ball is, it is the model's. Raises HardwareError of the line.
    """
    robot.reset(posture_rad, seed)
    rest = np.zeros(len(posture_rad))
    lengths = []
    for _ in range(MEASURED_PERIODS):
        state = robot.exchange(JointCommand(posture_rad, rest, rest)).state
        down_m = state.cup_in_world_m - state.ball_in_world_m
        lengths.append(float(np.linalg.norm(down_m)))
    if not np.isfinite(lengths).all():
        return game.rope.length_m
    return float(np.mean(lengths)) - stretch_m(game.ball.mass_kg * game.gravity_m_s2, game.rope.stiffness_n_m)


def scaled_motion(
    arm: RobotModel, plan: MotionPlan, scale: float, *, lead_in_m_s2: float, hold_s: float
) -> JointTrajectory:
    """Return the arm's motion for the swing of ``plan`` on a rope ``scale`` times as long, ending with ``hold_s`` at 1.

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
    """Motion for the measured rope: ``rope_scale`` times the model's; ``joints`` is as planned unless ``resized``.

    ``correction`` keeps a visual catch to what was found safe about it.
    """

    joints: JointTrajectory
    correction: CorrectionSettings
    rope_scale: float
    resized: bool


def fitted(
    robot: Robot, motion: CatchMotion, around: Surroundings, *, seed: int, rope_scale: float | None = None
) -> FittedMotion:
    """Return ``motion`` for the rope measured on ``robot``; as planned if the scaled one is beyond arm or safety.

    With a ``rope_scale`` that was measured before, the robot is not moved. The settings ``around`` it say how its
    joints were made from its plan. Raises StageError where it was made for other joints, before anything moves, or
    where it is not safe as planned; HardwareError of the line.
    """
    require_same_joints(robot, motion.joints)
    game, adapt = around.game, around.adapt
    if rope_scale is None:
        rope_scale = measured_rope_m(robot, motion.joints.position_rad[0], game, seed) / game.rope.length_m
    try:
        joints = scaled_motion(
            around.arm, motion.plan, rope_scale, lead_in_m_s2=adapt.lead_in_m_s2, hold_s=adapt.hold_s
        )
        correction, _ = around.correction(joints, follow_from_s(motion))
    except StageError:
        correction, _ = around.correction(motion.joints, follow_from_s(motion))
        return FittedMotion(motion.joints, correction, rope_scale, resized=False)
    return FittedMotion(joints, correction, rope_scale, resized=True)
