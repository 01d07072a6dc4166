"""The arm with its cup as one DART skeleton, with its limits and its kinematics."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.motion.task_settings import ProbeSettings
from kendama_cli.robot_model.description import Description, read_description
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings
from kendama_cli.settings.robot import PER_JOINT, RobotSettings
from kendama_cli.simulation.dart.cup import attach_cup, cup_frame
from kendama_cli.simulation.dart.library import dartpy
from kendama_cli.simulation.dart.probe import attach_probe

FAR_RAD = 1e3
"""A continuous joint has no position limits; this stands for them."""


TOP_SPEED_WITHIN_S = 0.15
"""Acceleration where nothing else is known: makers state limits that reach top speed in 0.1 to 0.3 s."""
STRIBECK_SHARE = 0.05
RADIUS_M = 0.06


class Arm:
    """The chain of ``robot`` holding the cup; ``skeleton``, ``cup`` and ``tie`` are DART's objects.

    With a probe as its tool, ``cup`` and ``tie`` are both the probe.

    Its arrays (n,) hold what counts, also where the settings leave it open (null). Raises InputError where the URDF
    cannot be used (see read_description).
    """

    def __init__(self, robot: RobotSettings, tool: CupSettings | ProbeSettings) -> None:
        description = read_description(robot.path, robot.base_link, robot.tip_link, robot.held_joints)
        self.settings = robot
        self.joint_names = description.joint_names
        self.tip_link = description.tip_link
        self._check_counts()
        self.skeleton = _load(description)
        place = dartpy.math.Isometry3()
        place.set_rotation(cup_frame(robot.tool.cup_axis))
        place.set_translation(np.array(robot.tool.handle_m))
        self.cup_in_tip = place
        holder = self.skeleton.getBodyNode(self.tip_link)
        if isinstance(tool, ProbeSettings):
            self.cup = self.tie = attach_probe(self.skeleton, holder, place, tool)
        else:
            self.cup, self.tie = attach_cup(self.skeleton, holder, place, tool)
        _place(self.skeleton, robot)
        n = len(self.joint_names)
        self.joints = [self.skeleton.getJoint(name) for name in self.joint_names]
        self.lower_rad = np.maximum(self.skeleton.getPositionLowerLimits(), -FAR_RAD)
        self.upper_rad = np.minimum(self.skeleton.getPositionUpperLimits(), FAR_RAD)
        self.velocity_rad_s = np.array(self.skeleton.getVelocityUpperLimits())
        self.effort_nm = np.array(self.skeleton.getForceUpperLimits())
        self.acceleration_rad_s2 = _values(robot.acceleration_rad_s2, self.velocity_rad_s / TOP_SPEED_WITHIN_S)
        self.home_rad = _values(robot.home_rad, (self.lower_rad + self.upper_rad) / 2)
        self.rotor_inertia_kg_m2 = _values(robot.rotor_inertia_kg_m2, np.zeros(n))
        self.coulomb_nm = _values(robot.coulomb_nm, np.zeros(n))
        self.viscous_nm_s = _values(robot.viscous_nm_s, np.zeros(n))
        self.stribeck_nm = _values(robot.stribeck_nm, np.zeros(n))
        self.stribeck_rad_s = _values(robot.stribeck_rad_s, STRIBECK_SHARE * self.velocity_rad_s)
        self.redundancy_weights = _values(robot.redundancy_weights, 1.0 / self.velocity_rad_s**2)
        self.link_radius_m = _values(robot.link_radius_m, np.full(n, RADIUS_M))
        for joint, rotor in zip(self.joints, self.rotor_inertia_kg_m2, strict=True):
            joint.setLimitEnforcement(True)
            _add_rotor(joint, rotor)

    def _check_counts(self) -> None:
        n = len(self.joint_names)
        for name in PER_JOINT:
            values = getattr(self.settings, name)
            if values is not None and len(values) != n:
                problem = f"has {n} moving joints on the way to '{self.tip_link}', robot.{name} has {len(values)}"
                raise InputError(self.settings.path, problem, remedy="give one value per joint")

    def mobility(self) -> Array:
        """The acceleration that 1 Nm gives each joint in the home posture: the diagonal of H^-1 (n,) [1/(kg m^2)]."""
        self.skeleton.setPositions(self.home_rad)
        return np.array(np.diag(self.skeleton.getInvMassMatrix()))

    def cup_place(self, position_rad: Array) -> Array:
        """The tie point in the world (3,) [m] for the joint angles (n,)."""
        self.skeleton.setPositions(position_rad)
        return np.array(self.cup.getWorldTransform().translation())

    def cup_task(self, position_rad: Array) -> tuple[Array, Array]:
        """Where the cup is, and how the joints move it.

        Returns the value (5,): tie point [m] and the turn that makes the cup upright, about world x and y [rad]; and
        the Jacobian (5, n) of the cup's velocity and of its turning about world x and y.
        """
        self.skeleton.setPositions(position_rad)
        place = self.cup.getWorldTransform()
        axis = place.rotation()[:, 2]
        jacobian = self.skeleton.getWorldJacobian(self.cup)
        # the turn that carries the axis onto z is axis x z; where the cup is head down it is lengthened to be found
        turn = np.array([axis[1], -axis[0]])
        if axis[2] < 0:
            turn /= max(float(np.linalg.norm(turn)), 1e-9)
        return np.concatenate([place.translation(), turn]), np.vstack([jacobian[3:], jacobian[:2]])


def _values(given: tuple[float, ...] | None, otherwise: Array) -> Array:
    return otherwise if given is None else np.array(given)


def _load(description: Description) -> Any:
    loader = dartpy.utils.DartLoader()
    options = dartpy.utils.DartLoader.Options()
    options.mDefaultRootJointType = dartpy.utils.DartLoader.RootJointType.FIXED
    loader.setOptions(options)
    skeleton = loader.parseSkeletonString(description.text, dartpy.common.Uri(""))
    if skeleton is None:
        raise InputError(description.path, "DART cannot build a robot from it", remedy="check it with a URDF checker")
    names = tuple(skeleton.getDof(i).getName() for i in range(skeleton.getNumDofs()))
    if names != description.joint_names:
        raise InputError(description.path, f"DART orders its joints {names}, the chain is {description.joint_names}")
    return skeleton


def _place(skeleton: Any, robot: RobotSettings) -> None:
    c, s = np.cos(robot.base_heading_rad), np.sin(robot.base_heading_rad)
    place = dartpy.math.Isometry3()
    place.set_rotation(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))
    place.set_translation(np.array(robot.base_position_m))
    skeleton.getRootJoint().setTransformFromParentBodyNode(place)


def _add_rotor(joint: Any, rotor_kg_m2: float) -> None:
    """Add the motor's inertia to the link that it turns, about the joint's axis.

    DART knows no rotors. The joint itself gets exactly its rotor on the diagonal of H; but here the rotor also turns
    with the links before it, which a geared one hardly does: where their axes are parallel, those joints come out
    heavier (the PA10's s1 by about 10 %, e2 by 16 %, the others by less than 4 %). Controller and arm share this model.
    """
    if rotor_kg_m2 <= 0.0:
        return
    link = joint.getChildBodyNode()
    inertia = link.getInertia()
    axis = joint.getTransformFromChildBodyNode().rotation() @ np.array(joint.getAxis())
    moment = np.array(inertia.getMoment()) + rotor_kg_m2 * np.outer(axis, axis)
    link.setInertia(dartpy.dynamics.Inertia(inertia.getMass(), inertia.getLocalCOM(), moment))
