"""An arm of a MuJoCo model in our world: at the base pose of its settings, with our cup at its tip, and our ball."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.mujoco.arm_joints import ArmJoints, add_servos, find_joints, tune_servos
from kendama_cli.plugins.mujoco.files import has_motors
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.plugins.mujoco.shapes import add_cup, ball_surface
from kendama_cli.robot_model.cup import cup_frame
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings, GameSettings
from kendama_cli.settings.robot import RobotSettings

MAX_DEVIATION_M = 0.002
"""Deviation of the cup between URDF and MuJoCo model that is allowed: those of the UR10e differ by 1.1 mm."""
POSITIONS = 50
CUP, BALL = "kendama cup", "kendama ball"
CONTACT_S, CONTACT_STEPS = 0.002, 2
"""Inverse of the undamped rate of the ball's contact with the cup, and the fewest steps in it."""


class Pose(NamedTuple):
    """Rotation (3, 3) and position (3,) [m] of a frame in another."""

    rotation: Array
    position_m: Array

    def __matmul__(self, other: Pose) -> Pose:
        """Return the pose in our outer frame of what has ``other`` in this one."""
        return Pose(self.rotation @ other.rotation, self.rotation @ other.position_m + self.position_m)

    def inverse(self) -> Pose:
        """Return the pose of the outer frame in this one."""
        return Pose(self.rotation.T, -self.rotation.T @ self.position_m)


def joint_axes(arm: RobotModel, position_rad: Array) -> tuple[Array, Array]:
    """Return a point (n, 3) [m] on each joint's axis and its direction (n, 3) in the world, at angles (n,).

    A column (v, w) of the Jacobian is v = w x (tie - p): p = tie + w x v is on the axis.
    """
    jacobian = arm.tool_jacobian(position_rad)
    speed, axes = jacobian[:3].T, jacobian[3:].T
    return arm.tool_position_m(position_rad) + np.cross(axes, speed), axes


def laid_upon(points_m: Array, axes: Array, onto_m: Array, onto_axes: Array) -> Pose:
    """Return the pose that lays lines (n, 3) upon others, in the sense of least squares.

    The rotation R maximises sum b.(R a) (Kabsch 1976, https://doi.org/10.1107/S0567739476001873), then t minimises the
    distances (1 - b b^T)(R p + t - q) of the points from the other lines.
    """
    u, _, vt = np.linalg.svd(onto_axes.T @ axes)
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    across = np.eye(3) - onto_axes[:, :, None] * onto_axes[:, None, :]
    apart = np.einsum("nij,nj->ni", across, onto_m - points_m @ rotation.T)
    moved, *_ = np.linalg.lstsq(across.reshape(-1, 3), apart.ravel(), rcond=None)
    return Pose(rotation, moved)


def mean_pose(poses: list[Pose]) -> Pose:
    """Return the rotation nearest to all, in the sense of least squares, and the mean position."""
    u, _, vt = np.linalg.svd(sum(pose.rotation for pose in poses))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return Pose(rotation, np.mean([pose.position_m for pose in poses], axis=0))


@dataclass(frozen=True)
class MujocoArm:
    """A compiled ``model`` with ``cup`` and ``ball`` as bodies; ``deviation_m`` is that of its cup from the URDF's."""

    model: Any
    joints: ArmJoints
    cup: int
    ball: int
    deviation_m: float


def build_arm(path: str, robot: RobotSettings, game: GameSettings, arm: RobotModel, timestep_s: float) -> MujocoArm:
    """Build the model of the file ``path``, which ``arm`` describes too, under our gravity and in our air.

    Its own shapes touch nothing; where it has motors, servos turn them (motors.py). Raises InputError where the file is
    no model of an arm with position servos, or where its cup is more than MAX_DEVIATION_M from the URDF's at some joint
    angles.
    """
    spec = _read(path)
    spec.option.timestep = timestep_s
    spec.option.integrator = mujoco().mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = [0.0, 0.0, -game.gravity_m_s2]
    spec.option.density = spec.option.viscosity = 0.0
    turned = add_servos(spec) if has_motors(Path(path)) else []
    model = _compiled(path, spec)
    joints = find_joints(path, model, arm.joint_names)
    place = _place(model, spec, joints, arm)
    _hold_cup(spec, joints.body, place, robot, game.cup)
    _add_ball(spec, game, timestep_s)
    model = _compiled(path, spec)
    joints = find_joints(path, model, arm.joint_names)
    tune_servos(model, joints, turned, sampled_positions(arm))
    made = MujocoArm(model, joints, model.body(CUP).id, model.body(BALL).id, 0.0)
    deviation_m = cup_deviation_m(made, arm, game)
    if not deviation_m <= MAX_DEVIATION_M:
        raise InputError(
            path,
            f"its cup is up to {1e3 * deviation_m:.1f} mm from that of robot={robot.name}; allowed: "
            f"{1e3 * MAX_DEVIATION_M:g} mm",
            remedy="choose the model of the arm that 'robot' describes (robot.path)",
        )
    return MujocoArm(model, joints, made.cup, made.ball, deviation_m)


def cup_deviation_m(made: MujocoArm, arm: RobotModel, game: GameSettings) -> float:
    """Return the largest distance [m] between both cups at POSITIONS random joint angles.

    Compared at the tie, at the rim's centre and beside the axis, so that a rotation counts too.
    """
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, game.cup.rim_m], [game.cup.outer_radius_m, 0.0, 0.0]])
    data = mujoco().MjData(made.model)
    worst = 0.0
    for position_rad in sampled_positions(arm):
        data.qpos[made.joints.position] = position_rad
        mujoco().mj_kinematics(made.model, data)
        there, ours = _pose(data, made.cup), arm.tool_pose(position_rad)
        apart = points @ (there.rotation - ours.rotation).T + there.position_m - ours.position_m
        worst = max(worst, float(np.linalg.norm(apart, axis=1).max()))
    return worst


def sampled_positions(arm: RobotModel) -> Array:
    """Return POSITIONS random joint angles (k, n) within the arm's limits and a turn to either side."""
    lower, upper = np.maximum(arm.limits.lower_rad, -np.pi), np.minimum(arm.limits.upper_rad, np.pi)
    fractions = np.random.default_rng(0).random((POSITIONS, len(lower)))
    return np.asarray(lower + fractions * (upper - lower))


def _read(path: str) -> Any:
    """Return the specification of the file without keyframes, its shapes meeting nothing."""
    try:
        spec = mujoco().MjSpec.from_file(os.path.abspath(path))  # by a relative one it misses meshes of includes
    except (ValueError, OSError) as error:
        raise InputError(path, f"MuJoCo cannot read it: {_first_line(error)}") from None
    for key in list(spec.keys):  # they have no place for the ball
        spec.delete(key)
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    return spec


def _compiled(path: str, spec: Any) -> Any:
    try:
        return spec.compile()
    except (ValueError, OSError) as error:
        raise InputError(path, f"MuJoCo cannot build it: {_first_line(error)}") from None


def _first_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]


def _pose(data: Any, body: int) -> Pose:
    return Pose(data.xmat[body].reshape(3, 3).copy(), data.xpos[body].copy())


def _place(model: Any, spec: Any, joints: ArmJoints, arm: RobotModel) -> Pose:
    """Move the body that carries the arm so that the joints' axes are where ``arm`` has them.

    Returns the pose of its cup in the last joint's body. Both are fitted over POSITIONS joint angles.
    """
    data = mujoco().MjData(model)
    lines, onto, bodies = [], [], []
    for position_rad in sampled_positions(arm):
        data.qpos[joints.position] = position_rad
        mujoco().mj_kinematics(model, data)
        lines.append((data.xanchor[joints.joint].copy(), data.xaxis[joints.joint].copy()))
        onto.append(joint_axes(arm, position_rad))
        tool = arm.tool_pose(position_rad)
        bodies.append((_pose(data, joints.body), Pose(tool.rotation, tool.position_m)))
    place = laid_upon(*map(np.concatenate, zip(*lines, strict=True)), *map(np.concatenate, zip(*onto, strict=True)))
    root = int(model.body_rootid[joints.body])
    _set_pose(_body(spec, root), place @ _pose(data, root))
    return mean_pose([(place @ body).inverse() @ cup for body, cup in bodies])


def _hold_cup(spec: Any, body: int, place: Pose, robot: RobotSettings, cup: CupSettings) -> None:
    """Add the cup to ``body`` at ``place``, with a sensor of the wrench between them."""
    mj = mujoco()
    lateral = cup.mass_kg * (cup.radius_m**2 / 2 + cup.depth_m**2 / 12)
    held = _body(spec, body).add_body(
        name=CUP,
        mass=cup.mass_kg,
        gravcomp=_body(spec, body).gravcomp,
        ipos=[0.0, 0.0, cup.floor_m + cup.depth_m / 2],
        inertia=[lateral, lateral, cup.mass_kg * cup.radius_m**2],
        explicitinertial=1,
    )
    _set_pose(held, place)
    add_cup(mj, held, cup)
    tip = Pose(cup_frame(robot.tool.cup_axis), np.array(robot.tool.handle_m)).inverse()
    _set_pose(held.add_site(name=CUP), tip)
    for name, kind in (("kendama force", mj.mjtSensor.mjSENS_FORCE), ("kendama torque", mj.mjtSensor.mjSENS_TORQUE)):
        spec.add_sensor(name=name, type=kind, objtype=mj.mjtObj.mjOBJ_SITE, objname=CUP)


def _add_ball(spec: Any, game: GameSettings, timestep_s: float) -> None:
    ball = spec.worldbody.add_body(name=BALL)
    ball.add_freejoint()
    ball.add_geom(
        type=mujoco().mjtGeom.mjGEOM_SPHERE,
        size=[game.ball.radius_m, 0, 0],
        mass=game.ball.mass_kg,
        **ball_surface(game.cup.friction, game.cup.restitution, max(CONTACT_S, CONTACT_STEPS * timestep_s)),
    )


def _body(spec: Any, number: int) -> Any:
    return next(body for body in spec.bodies if body.id == number)


def _set_pose(element: Any, pose: Pose) -> None:
    quat = np.zeros(4)
    mujoco().mju_mat2Quat(quat, np.ascontiguousarray(pose.rotation).ravel())
    element.alt.type = mujoco().mjtOrientation.mjORIENTATION_QUAT  # else angles that the file gave count
    element.pos, element.quat = pose.position_m, quat
