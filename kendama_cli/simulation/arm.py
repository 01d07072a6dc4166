"""The arm with its cup as one DART skeleton, with its limits and its kinematics."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.errors import InputError
from kendama_cli.settings.game import CupSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.cup import attach_cup, cup_frame
from kendama_cli.simulation.dart import dartpy
from kendama_cli.simulation.description import Description, read_description

FAR_RAD = 1e3
"""A continuous joint has no position limits; this stands for them."""


class Arm:
    """The chain of ``robot`` holding the cup; ``skeleton``, ``cup`` and ``tie`` are DART's objects.

    Raises InputError where the URDF cannot be used (see read_description).
    """

    def __init__(self, robot: RobotSettings, cup: CupSettings) -> None:
        description = read_description(robot.urdf, robot.tip_link)
        n = len(description.joint_names)
        if n != len(robot.home_rad):
            problem = (
                f"has {n} moving joints on the way to '{robot.tip_link}', robot.home_rad has {len(robot.home_rad)}"
            )
            raise InputError(robot.urdf, problem, remedy="give one value per joint")
        self.settings = robot
        self.joint_names = description.joint_names
        self.skeleton = _load(description)
        tip = self.skeleton.getBodyNode(robot.tip_link)
        place = dartpy.math.Isometry3()
        place.set_rotation(cup_frame(robot.tool.cup_axis))
        place.set_translation(np.array(robot.tool.handle_m))
        self.cup, self.tie = attach_cup(self.skeleton, tip, place, cup)
        _place(self.skeleton, robot)
        joints = [self.skeleton.getJoint(name) for name in self.joint_names]
        for joint, rotor, viscous in zip(joints, robot.rotor_inertia_kg_m2, robot.viscous_nm_s, strict=True):
            joint.setLimitEnforcement(True)
            joint.setDampingCoefficient(0, viscous)
            _add_rotor(joint, rotor)
        self.joints = joints
        self.lower_rad = np.maximum(self.skeleton.getPositionLowerLimits(), -FAR_RAD)
        self.upper_rad = np.minimum(self.skeleton.getPositionUpperLimits(), FAR_RAD)
        self.velocity_rad_s = np.array(self.skeleton.getVelocityUpperLimits())
        self.effort_nm = np.array(self.skeleton.getForceUpperLimits())
        self.acceleration_rad_s2 = np.array(robot.acceleration_rad_s2)
        self.home_rad = np.array(robot.home_rad)

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

    DART knows no rotors; this leaves out that a geared rotor does not turn with the links before it, which is small
    beside those links' own inertia.
    """
    if rotor_kg_m2 <= 0.0:
        return
    link = joint.getChildBodyNode()
    inertia = link.getInertia()
    axis = joint.getTransformFromChildBodyNode().rotation() @ np.array(joint.getAxis())
    moment = np.array(inertia.getMoment()) + rotor_kg_m2 * np.outer(axis, axis)
    link.setInertia(dartpy.dynamics.Inertia(inertia.getMass(), inertia.getLocalCOM(), moment))
