"""The probe: a ball at the end of a massless rod, the tool with which the arm touches things."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.motion.task_settings import ProbeSettings
from kendama_cli.robot_model.dart_library import dartpy

POINT_KG_M2 = 1e-9
"""Its mass is a point; DART wants an inertia that is not zero."""


def attach_probe(skeleton: Any, holder: Any, place: Any, probe: ProbeSettings) -> Any:
    """Weld the probe to the body ``holder`` at ``place`` (the ball's centre); returns its body."""
    joint, body = skeleton.createWeldJointAndBodyNodePair(holder)
    joint.setTransformFromParentBodyNode(place)
    body.setName("probe")
    body.setInertia(dartpy.dynamics.Inertia(probe.mass_kg, np.zeros(3), np.eye(3) * POINT_KG_M2))
    node = body.createShapeNode(dartpy.dynamics.SphereShape(probe.radius_m))
    node.setName("probe")
    node.createCollisionAspect()
    surface = node.createDynamicsAspect()
    surface.setFrictionCoeff(probe.friction)
    surface.setRestitutionCoeff(probe.restitution)
    return body
