"""The bodies of an arm and its tool as one DART skeleton, built from the arm's description and settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.motion.dmp.heading import heading_turn
from kendama_cli.robot_model.cup import attach_cup, cup_frame
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.robot_model.description import LIMITS, Description, dart_name
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings
from kendama_cli.settings.robot import RobotSettings

AttachTool = Callable[[Any, Any, Any], tuple[Any, Any]]
"""Weld a tool to a body of a skeleton at a pose in its frame; returns its body, and the body of the rope's tie."""


@dataclass(frozen=True)
class Body:
    """DART's objects of one arm with its tool: whoever holds them holds a state that moves.

    ``cup`` is the tool, ``tie`` its point at which the rope is tied. ``tip`` is the link that holds the handle, and
    ``tool_in_tip`` the tool's pose in its frame.
    """

    skeleton: Any
    joints: tuple[Any, ...]
    tip: Any
    cup: Any
    tie: Any
    tool_in_tip: Any

    def put(self, position_rad: Array, velocity_rad_s: Array) -> None:
        """Set the joints to ``position_rad`` (n,) and ``velocity_rad_s`` (n,), without forces on them."""
        skeleton = self.skeleton
        skeleton.resetAccelerations()
        skeleton.resetGeneralizedForces()
        skeleton.setPositions(position_rad)
        skeleton.setVelocities(velocity_rad_s)
        skeleton.clearExternalForces()


def build_body(description: Description, robot: RobotSettings, tool: CupSettings | AttachTool) -> Body:
    """Return the chain of ``description`` at the base pose of ``robot``, with ``tool``; joints are kept within
    their limits.

    Its links have no rotors: DART knows none, and whoever moves it accounts for them (see RobotModel). Raises
    InputError where DART cannot build it.
    """
    skeleton = _load(description)
    pose = dartpy.math.Isometry3()
    pose.set_rotation(cup_frame(robot.tool.cup_axis))
    pose.set_translation(np.array(robot.tool.handle_m))
    tip = skeleton.getBodyNode(dart_name(description.tip_link))
    attach = partial(attach_cup, cup=tool) if isinstance(tool, CupSettings) else tool
    cup, tie = attach(skeleton, tip, pose)
    base = dartpy.math.Isometry3()
    base.set_rotation(heading_turn(robot.base_heading_rad))
    base.set_translation(np.array(robot.base_position_m))
    skeleton.getRootJoint().setTransformFromParentBodyNode(base)
    joints = tuple(skeleton.getJoint(name) for name in description.joint_names)
    limits = zip(joints, *(description.limits[key] for key in LIMITS), strict=True)
    for joint, lower, upper, velocity, effort in limits:
        joint.setPositionLowerLimit(0, lower)
        joint.setPositionUpperLimit(0, upper)
        joint.setVelocityLowerLimit(0, -velocity)
        joint.setVelocityUpperLimit(0, velocity)
        joint.setForceLowerLimit(0, -effort)
        joint.setForceUpperLimit(0, effort)
        joint.setLimitEnforcement(True)
    return Body(skeleton, joints, tip, cup, tie, pose)


def _load(description: Description) -> Any:
    loader = dartpy.utils.DartLoader()
    options = dartpy.utils.DartLoader.Options()
    options.mDefaultRootJointType = dartpy.utils.DartLoader.RootJointType.FIXED
    loader.setOptions(options)
    skeleton = loader.parseSkeletonString(description.urdf(), dartpy.common.Uri(""))
    if skeleton is None:
        raise InputError(description.path, "DART cannot build a robot from it", remedy="check it with a URDF checker")
    names = tuple(skeleton.getDof(i).getName() for i in range(skeleton.getNumDofs()))
    if names != description.joint_names:
        raise InputError(description.path, f"DART orders its joints {names}, the chain is {description.joint_names}")
    return skeleton
