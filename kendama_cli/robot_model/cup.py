"""The cup as a rigid body: a ring of box staves on a round floor."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings, HandleTie

TIE_MASS_KG = 1e-6
"""The tie point is a body of its own, so that DART hands out its position and velocity in one cheap call."""


def cup_frame(cup_axis: tuple[float, float, float]) -> Array:
    """Return a rotation (3, 3) whose z is ``cup_axis``; the turn about it is arbitrary, the cup being round."""
    return frame_along(np.asarray(cup_axis, dtype=np.float64) / math.hypot(*cup_axis))


def frame_along(z: Array) -> Array:
    """Return a rotation (3, 3) whose z is that unit vector (3,)."""
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def attach_cup(skeleton: Any, holder: Any, place: Any, cup: CupSettings) -> tuple[Any, Any]:
    """Weld the cup to the body ``holder`` at ``place`` (z along its axis); returns (cup, its position as a body)."""
    joint, body = skeleton.createWeldJointAndBodyNodePair(holder)
    joint.setTransformFromParentBodyNode(place)
    body.setName("cup")
    body.setInertia(_inertia(cup))
    for stave in range(cup.staves):
        _add_stave(body, cup, 2 * math.pi * stave / cup.staves)
    floor = dartpy.dynamics.CylinderShape(cup.radius_m, cup.wall_m)
    _add_shape(body, floor, np.eye(3), (0.0, 0.0, cup.floor_m + cup.wall_m / 2), cup)
    if isinstance(cup.tie, HandleTie):
        handle = dartpy.dynamics.CylinderShape(cup.tie.radius_m, cup.tie.length_m)
        _add_shape(body, handle, np.eye(3), (0.0, 0.0, cup.tie.length_m / 2), cup)
    _, tie = skeleton.createWeldJointAndBodyNodePair(body)
    tie.setName("tie")
    tie.setInertia(dartpy.dynamics.Inertia(TIE_MASS_KG, np.zeros(3), np.eye(3) * 1e-10))
    return body, tie


def set_restitution(cup: Any, restitution: float) -> None:
    """Give every part of the cup ``restitution``; the ball's is 1, and DART takes the product of both."""
    for node in cup.getShapeNodes():
        node.getDynamicsAspect().setRestitutionCoeff(restitution)


def _inertia(cup: CupSettings) -> Any:
    across = cup.mass_kg * (cup.radius_m**2 / 2 + cup.depth_m**2 / 12)
    along = cup.mass_kg * cup.radius_m**2
    center = np.array([0.0, 0.0, cup.floor_m + cup.depth_m / 2])
    return dartpy.dynamics.Inertia(cup.mass_kg, center, np.diag([across, across, along]))


def _add_stave(body: Any, cup: CupSettings, angle: float) -> None:
    width = 2 * (cup.radius_m + cup.wall_m) * math.tan(math.pi / cup.staves)
    shape = dartpy.dynamics.BoxShape(np.array([cup.wall_m, width, cup.depth_m]))
    c, s = math.cos(angle), math.sin(angle)
    out = cup.radius_m + cup.wall_m / 2
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    _add_shape(body, shape, rotation, (out * c, out * s, cup.floor_m + cup.depth_m / 2), cup)


def _add_shape(body: Any, shape: Any, turn: Array, at: tuple[float, float, float], cup: CupSettings) -> None:
    node = body.createShapeNode(shape)
    node.createCollisionAspect()
    pose = dartpy.math.Isometry3()
    pose.set_rotation(turn)
    pose.set_translation(np.asarray(at))
    node.setRelativeTransform(pose)
    surface = node.createDynamicsAspect()
    surface.setRestitutionCoeff(cup.restitution)
    surface.setFrictionCoeff(cup.friction)
