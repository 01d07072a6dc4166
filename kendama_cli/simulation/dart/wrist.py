"""Sensor at the wrist: the wrench between tip link and tool."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from kendama_cli.motion.rotation import cross
from kendama_cli.robot_model.body import Body
from kendama_cli.schema.arrays import Array


def wrist_wrench(body: Body, contacts: Iterable[Any]) -> Array:
    """Return the tool's wrench on the tip link after the last step, in that link's frame at its origin.

    (6,), force [N], then torque [Nm]: the weight of the tool at rest, its inertia in motion, and what touches it, of
    ``contacts``. Other forces on the tool must be set on its bodies before; all of them are cleared.
    """
    tool = body.cup
    for contact in contacts:
        if body_of(contact.collisionObject1) == tool:
            tool.addExtForce(contact.force, contact.point, False, False)
        elif body_of(contact.collisionObject2) == tool:
            tool.addExtForce(-contact.force, contact.point, False, False)
    body.skeleton.computeInverseDynamics(True, False, False)
    held = np.array(tool.getBodyForce())
    body.skeleton.clearExternalForces()
    rotation, at = body.tool_in_tip.rotation(), body.tool_in_tip.translation()
    force = rotation @ held[3:]
    return -np.concatenate([force, rotation @ held[:3] + cross(at, force)])


def body_of(touching: Any) -> Any:
    return touching.getShapeFrame().asShapeNode().getBodyNodePtr()
