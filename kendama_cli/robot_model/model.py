"""What is believed about an arm with its tool: limits, friction, kinematics and dynamics at any joint angles."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from kendama_cli.artifacts.friction_model import ParametricFriction
from kendama_cli.errors import InputError
from kendama_cli.motion.task_settings import ProbeSettings
from kendama_cli.robot_model.body import Body, build_body
from kendama_cli.robot_model.description import read_description
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings
from kendama_cli.settings.robot import PER_JOINT, RobotSettings

UNLIMITED_RAD = 1e3
"""A continuous joint has no position limits; this stands for them."""
TOP_SPEED_WITHIN_S = 0.15
"""Acceleration where nothing else is known: makers state limits that reach top speed in 0.1 to 0.3 s."""
STRIBECK_SHARE = 0.05
LINK_RADIUS_M = 0.06
HANDLE_RADIUS_M = 0.015
UPRIGHT = np.eye(3)[:2]
"""What the axis of an upright cup is perpendicular to."""


class ToolPose(NamedTuple):
    """Where the tool is in the world: the tie point (3,) [m] and a rotation (3, 3) whose z is the cup's axis."""

    position_m: Array
    rotation: Array


class RobotModel:
    """The chain of ``robot`` holding ``tool`` under gravity: a query takes the joint angles and moves nothing.

    ``limits``, ``friction`` and the arrays (n,) hold what counts, also where the settings leave it open (null). A
    world takes its own movable objects from ``new_body``. One instance belongs to one thread. Raises InputError where
    the URDF cannot be used (see read_description) or a list of the settings has not one value per joint.
    """

    def __init__(self, robot: RobotSettings, tool: CupSettings | ProbeSettings, gravity_m_s2: float) -> None:
        self._description = read_description(robot.path, robot.base_link, robot.tip_link, robot.held_joints)
        self._tool = tool
        self.settings = robot
        self.gravity_m_s2 = gravity_m_s2
        self.joint_names = self._description.joint_names
        self.tip_link = self._description.tip_link
        self._check_counts()
        self._body = self.new_body()
        self._skeleton = self._body.skeleton
        self._skeleton.setGravity(np.array([0.0, 0.0, -gravity_m_s2]))
        self.limits = _limits(self._skeleton, robot)
        velocity, n = self.limits.velocity_rad_s, len(self.joint_names)
        self.friction = ParametricFriction(
            coulomb_nm=_values(robot.coulomb_nm, np.zeros(n)),
            stribeck_nm=_values(robot.stribeck_nm, np.zeros(n)),
            stribeck_rad_s=_values(robot.stribeck_rad_s, STRIBECK_SHARE * velocity),
            viscous_nm_s=_values(robot.viscous_nm_s, np.zeros(n)),
            offset_nm=np.zeros(n),
        )
        self.home_rad = _values(robot.home_rad, (self.limits.lower_rad + self.limits.upper_rad) / 2)
        self.rotor_inertia_kg_m2 = _values(robot.rotor_inertia_kg_m2, np.zeros(n))
        self.redundancy_weights = _values(robot.redundancy_weights, 1.0 / velocity**2)
        self.link_radius_m = _values(robot.link_radius_m, np.full(n, LINK_RADIUS_M))

    def new_body(self) -> Body:
        """New DART objects of this arm and its tool, for a world to move."""
        return build_body(self._description, self.settings, self._tool, self.settings.rotor_inertia_kg_m2)

    def tool_pose(self, position_rad: Array) -> ToolPose:
        """Where the tool is for the joint angles (n,)."""
        place = self._posed(position_rad).cup.getWorldTransform()
        return ToolPose(np.array(place.translation()), np.array(place.rotation()))

    def tool_place_m(self, position_rad: Array) -> Array:
        """The tie point in the world (3,) [m] for the joint angles (n,)."""
        return self.tool_pose(position_rad).position_m

    def tool_jacobian(self, position_rad: Array) -> Array:
        """The Jacobian (6, n) of the tie point's velocity [m/s] and the tool's rate of turn [rad/s], in the world."""
        body = self._posed(position_rad)
        jacobian = body.skeleton.getWorldJacobian(body.cup)
        return np.vstack([jacobian[3:], jacobian[:3]])

    def cup_task(self, position_rad: Array, about: Array = UPRIGHT) -> tuple[Array, Array]:
        """Where the cup is and points, and how the joints move it; how far it has spun about its axis does not matter.

        ``about`` (2, 3) are the orthonormal directions to which the cup's axis shall be perpendicular: world x and y
        where it shall be upright. Returns the value (5,): tie point [m] and the turn about these that is missing
        [rad]; and the Jacobian (5, n) of the cup's velocity and of its turning about them.
        """
        pose, jacobian = self.tool_pose(position_rad), self.tool_jacobian(position_rad)
        axis, wanted = pose.rotation[:, 2], _cross(about[0], about[1])
        # the turn that carries the axis onto the wanted one; where the cup is head down it is lengthened to be found
        turn = about @ _cross(axis, wanted)
        if axis @ wanted < 0:
            turn /= max(float(np.linalg.norm(turn)), 1e-9)
        return np.concatenate([pose.position_m, turn]), np.vstack([jacobian[:3], about @ jacobian[3:]])

    def base_pose(self) -> tuple[Array, Array]:
        """The rotation (3, 3) and place (3,) [m] of the arm's root in the world."""
        place = self._skeleton.getBodyNode(0).getWorldTransform()
        return np.array(place.rotation()), np.array(place.translation())

    def joint_places_m(self, position_rad: Array) -> Array:
        """The joints' origins and the tip link's (n + 1, 3) in the world [m] for the joint angles (n,)."""
        body = self._posed(position_rad)
        places = [
            joint.getChildBodyNode().getWorldTransform().multiply(joint.getTransformFromChildBodyNode()).translation()
            for joint in body.joints
        ]
        return np.array([*places, body.tip.getWorldTransform().translation()])

    def tip_jacobian(self, position_rad: Array) -> Array:
        """The Jacobian (6, n) of the tip link's velocity and rate of turn, in its own frame and at its origin."""
        body = self._posed(position_rad)
        jacobian = body.skeleton.getJacobian(body.tip)
        return np.vstack([jacobian[3:], jacobian[:3]])

    def rigid_effort_nm(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array) -> Array:
        """The torques H q'' + C q' + g (n,) [Nm] of a motion by inverse dynamics, without friction and rope."""
        skeleton = self._posed(position_rad).skeleton
        skeleton.setVelocities(velocity_rad_s)
        skeleton.setAccelerations(acceleration_rad_s2)
        skeleton.computeInverseDynamics(False, False, False)
        return np.array(skeleton.getForces())

    def _posed(self, position_rad: Array) -> Body:
        """The model's own body, put where the query asks; its pose is never read without being set."""
        self._skeleton.setPositions(position_rad)
        return self._body

    def _check_counts(self) -> None:
        n = len(self.joint_names)
        for name in PER_JOINT:
            values = getattr(self.settings, name)
            if values is not None and len(values) != n:
                problem = f"has {n} moving joints on the way to '{self.tip_link}', robot.{name} has {len(values)}"
                raise InputError(self.settings.path, problem, remedy="give one value per joint")


def _cross(one: Array, two: Array) -> Array:
    """The cross product of two vectors (3,); numpy's own takes ten times as long."""
    a, b, c = one.tolist()
    x, y, z = two.tolist()
    return np.array([b * z - c * y, c * x - a * z, a * y - b * x])


def _limits(skeleton: Any, robot: RobotSettings) -> JointLimits:
    velocity = np.array(skeleton.getVelocityUpperLimits())
    return JointLimits(
        lower_rad=np.maximum(skeleton.getPositionLowerLimits(), -UNLIMITED_RAD),
        upper_rad=np.minimum(skeleton.getPositionUpperLimits(), UNLIMITED_RAD),
        velocity_rad_s=velocity,
        acceleration_rad_s2=_values(robot.acceleration_rad_s2, velocity / TOP_SPEED_WITHIN_S),
        effort_nm=np.array(skeleton.getForceUpperLimits()),
    )


def _values(given: tuple[float, ...] | None, otherwise: Array) -> Array:
    return otherwise if given is None else np.array(given)
