"""What the simulated arm's links have beside those of its model: rotors, and capsules that a ball can touch."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.robot_model.model import HANDLE_RADIUS_M, RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings

SHORTEST_M = 1e-3
"""A link whose joints' origins coincide has no capsule of its own: its neighbours' caps cover it."""


def attach_rotors(body: Body, rotor_inertia_kg_m2: Array) -> None:
    """Give every link the rotor (n,) of the joint that turns it, about that joint's axis (see carry_rotors)."""
    for joint, rotor in zip(body.joints, rotor_inertia_kg_m2, strict=True):
        link = joint.getChildBodyNode()
        own = link.getInertia()
        axis = joint.getTransformFromChildBodyNode().rotation() @ np.array(joint.getAxis())
        moment = np.array(own.getMoment()) + rotor * np.outer(axis, axis)
        link.setInertia(dartpy.dynamics.Inertia(own.getMass(), own.getLocalCOM(), moment))


def attach_links(body: Body, arm: RobotModel, cup: CupSettings) -> None:
    """Give every link a capsule of ``robot.link_radius_m`` from its joint's origin to the next one's, and the handle.

    The handle ends at the cup's wall. Parts of the arm do not touch each other.
    """
    body.skeleton.setPositions(arm.home_rad)
    places = arm.joint_places_m(arm.home_rad)
    links = [joint.getChildBodyNode() for joint in body.joints]
    for link, radius, (start, end) in zip(links, arm.link_radius_m, pairwise(places), strict=True):
        _attach_capsule(link, start, end, float(radius))
    handle = arm.tool_place_m(arm.home_rad) - places[-1]
    length = float(np.linalg.norm(handle))
    short = max(length - cup.radius_m - cup.wall_m - HANDLE_RADIUS_M, 0.0)
    if length > SHORTEST_M:
        _attach_capsule(body.tip, places[-1], places[-1] + handle * (short / length), HANDLE_RADIUS_M)


def _attach_capsule(link: Any, start_m: Array, end_m: Array, radius_m: float) -> None:
    """A capsule between two points of the world, fixed to ``link`` where that is now."""
    way = end_m - start_m
    length = float(np.linalg.norm(way))
    if length < SHORTEST_M:
        return
    z = way / length
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    place = dartpy.math.Isometry3()
    place.set_rotation(np.column_stack([x, np.cross(z, x), z]))
    place.set_translation((start_m + end_m) / 2)
    node = link.createShapeNode(dartpy.dynamics.CapsuleShape(radius_m, length))
    node.createCollisionAspect()
    node.createDynamicsAspect()
    node.setRelativeTransform(link.getWorldTransform().inverse().multiply(place))
