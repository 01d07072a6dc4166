"""Model of an arm with its tool: limits, friction, kinematics and dynamics at any joint angles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kendama_cli.artifacts.friction_model import ParametricFriction
from kendama_cli.errors import ConfigError
from kendama_cli.robot_model.body import AttachTool, Body, build_body
from kendama_cli.robot_model.composed import check_composed
from kendama_cli.robot_model.description import dart_name, read_description
from kendama_cli.robot_model.limit_doubts import placeholder_in
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings
from kendama_cli.settings.robot import RobotSettings

TOP_SPEED_WITHIN_S = 0.15
"""Acceleration where nothing else is known: makers state limits that reach top speed in 0.1 to 0.3 s."""
STRIBECK_SHARE = 0.05
LINK_RADIUS_M = 0.06
HANDLE_RADIUS_M = 0.015
UPRIGHT = np.eye(3)[:2]
"""What the axis of an upright cup is perpendicular to."""


class ToolPose(NamedTuple):
    """Pose of the tool in the world: the tie point (3,) [m] and a rotation (3, 3) whose z is the cup's axis.

    Of a link: its origin and its axes.
    """

    position_m: Array
    rotation: Array


class RobotModel:
    """The chain of ``robot`` holding ``tool`` under gravity: a query takes the joint angles and moves nothing.

    ``limits``, ``friction`` and the arrays (n,) hold what counts, also where the settings leave it open (null). A
    world takes its own movable objects from ``new_body``. A rotor adds to the diagonal of H alone, as pinocchio's and
    MuJoCo's ``armature`` does: geared, it turns so much faster than the links before it that their turning hardly
    counts (Featherstone 2008, section 9.6). One instance belongs to one thread. Raises InputError where the URDF cannot
    be used (see read_description), or where DART makes another arm of it than the file describes.
    """

    def __init__(self, robot: RobotSettings, tool: CupSettings | AttachTool, gravity_m_s2: float) -> None:
        self.description = found = read_description(robot)
        self._tool = tool
        self.settings = robot
        self.gravity_m_s2 = gravity_m_s2
        self.joint_names = found.joint_names
        self.tip_link = found.tip_link
        n = len(self.joint_names)
        self.rotor_inertia_kg_m2 = _values(robot.rotor_inertia_kg_m2, np.zeros(n))
        self._body = self.new_body()
        self._skeleton = self._body.skeleton
        self._skeleton.setGravity(np.array([0.0, 0.0, -gravity_m_s2]))
        check_composed(found, self._skeleton, self.rotor_inertia_kg_m2)
        given = {key: np.array(values) for key, values in found.limits.items()}
        velocity = given["velocity_rad_s"]
        acceleration = _values(robot.acceleration_rad_s2, velocity / TOP_SPEED_WITHIN_S)
        self.limits = JointLimits(**given, acceleration_rad_s2=acceleration)
        self.friction = ParametricFriction(
            coulomb_nm=np.array(found.friction["coulomb_nm"]),
            stribeck_nm=_values(robot.stribeck_nm, np.zeros(n)),
            stribeck_rad_s=_values(robot.stribeck_rad_s, STRIBECK_SHARE * velocity),
            viscous_nm_s=np.array(found.friction["viscous_nm_s"]),
            offset_nm=np.zeros(n),
        )
        self.home_rad = _values(robot.home_rad, (self.limits.lower_rad + self.limits.upper_rad) / 2)
        self.redundancy_weights = _values(robot.redundancy_weights, 1.0 / velocity**2)
        self.link_radius_m = _values(robot.link_radius_m, np.full(n, LINK_RADIUS_M))

    def limit_doubt(self, kind: str) -> str:
        """Return in brackets why the limit of ``kind`` (speed, acceleration, effort) may be none of the maker's."""
        if kind == "acceleration":
            if self.settings.acceleration_rad_s2 is not None:
                return ""
            return (
                f" (a rule of thumb: top speed within {TOP_SPEED_WITHIN_S} s; robot.acceleration_rad_s2 gives its own)"
            )
        key = {"speed": "velocity_rad_s", "effort": "effort_nm"}[kind]
        doubt = placeholder_in(key, self.description.limits[key], self.description.sources[key])
        return f" (a placeholder? {doubt})" if doubt else ""

    def new_body(self) -> Body:
        """Return new DART objects of this arm and its tool, for a world to move."""
        return build_body(self.description, self.settings, self._tool)

    def tool_pose(self, position_rad: Array) -> ToolPose:
        """Return the pose of the tool for the joint angles (n,)."""
        pose = self.posed(position_rad).cup.getWorldTransform()
        return ToolPose(np.array(pose.translation()), np.array(pose.rotation()))

    def link_pose(self, link: str, position_rad: Array) -> ToolPose:
        """Return the pose of ``link`` in the world for the joint angles (n,); raises ConfigError for no link of it."""
        if link not in self.description.tree.links:
            known = ", ".join(self.description.tree.links)
            raise ConfigError("link", f"{self.settings.called} has no link '{link}'; its links are {known}")
        pose = self.posed(position_rad).skeleton.getBodyNode(dart_name(link)).getWorldTransform()
        return ToolPose(np.array(pose.translation()), np.array(pose.rotation()))

    def tool_position_m(self, position_rad: Array) -> Array:
        """Return the tie point in the world (3,) [m] for the joint angles (n,)."""
        return self.tool_pose(position_rad).position_m

    def tool_jacobian(self, position_rad: Array) -> Array:
        """Return the Jacobian (6, n) of the tie point's velocity [m/s] and the tool's angular velocity [rad/s], in
        the world.
        """
        body = self.posed(position_rad)
        jacobian = body.skeleton.getWorldJacobian(body.cup)
        return np.vstack([jacobian[3:], jacobian[:3]])

    def cup_task(self, position_rad: Array, about: Array = UPRIGHT) -> tuple[Array, Array]:
        """Return the position and axis of the cup, and their Jacobian; rotation of the cup about its axis does not
        matter.

        ``about`` (2, 3) are the orthonormal directions to which the cup's axis shall be perpendicular: world x and y
        where it shall be upright. Returns the value (5,): tie point [m] and the turn about these that is missing
        [rad]; and the Jacobian (5, n) of the cup's velocity and of its turning about them.
        """
        pose, jacobian = self.tool_pose(position_rad), self.tool_jacobian(position_rad)
        axis, desired = pose.rotation[:, 2], _cross(about[0], about[1])
        # the turn that carries the axis onto the desired one; where the cup is head down it is lengthened to be found
        rotation = about @ _cross(axis, desired)
        if axis @ desired < 0:
            rotation /= max(float(np.linalg.norm(rotation)), 1e-9)
        return np.concatenate([pose.position_m, rotation]), np.vstack([jacobian[:3], about @ jacobian[3:]])

    def base_pose(self) -> tuple[Array, Array]:
        """Return the rotation (3, 3) and position (3,) [m] of the arm's root in the world."""
        pose = self._skeleton.getBodyNode(0).getWorldTransform()
        return np.array(pose.rotation()), np.array(pose.translation())

    def joint_positions_m(self, position_rad: Array) -> Array:
        """Return the positions (n + 1, 3) of the joints' origins and the tip link in the world [m] for the joint
        angles (n,).
        """
        body = self.posed(position_rad)
        positions = [
            joint.getChildBodyNode().getWorldTransform().multiply(joint.getTransformFromChildBodyNode()).translation()
            for joint in body.joints
        ]
        return np.array([*positions, body.tip.getWorldTransform().translation()])

    def rigid_effort_nm(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array) -> Array:
        """Return the torques H q'' + C q' + g (n,) [Nm] of a motion by inverse dynamics, without friction and rope.

        H is that of the links, with each joint's rotor on its diagonal.
        """
        skeleton = self.posed(position_rad, velocity_rad_s).skeleton
        skeleton.setAccelerations(acceleration_rad_s2)
        skeleton.computeInverseDynamics(False, False, False)
        return np.array(skeleton.getForces()) + self.rotor_inertia_kg_m2 * acceleration_rad_s2

    def posed(self, position_rad: Array, velocity_rad_s: Array | None = None) -> Body:
        """Set the model's own body to the state (n,) and return it; its pose is never read without being set."""
        self._skeleton.setPositions(position_rad)
        if velocity_rad_s is not None:
            self._skeleton.setVelocities(velocity_rad_s)
        return self._body


def _cross(one: Array, two: Array) -> Array:
    """Return the cross product of two vectors (3,); numpy's function takes ten times as long."""
    a, b, c = one.tolist()
    x, y, z = two.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def _values(given: tuple[float, ...] | None, otherwise: Array) -> Array:
    return otherwise if given is None else np.array(given)
