"""The ball: a sphere that moves freely without turning."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.settings.game import BallSettings, CupSettings


def make_ball(ball: BallSettings, cup: CupSettings) -> Any:
    """A skeleton of one sphere on a translational joint, its three positions being those of the centre in the world.

    DART multiplies the restitution of both bodies and takes the smaller friction: the ball has 1 and the cup's own.
    """
    skeleton = dartpy.dynamics.Skeleton("ball")
    _, body = skeleton.createTranslationalJointAndBodyNodePair()
    body.setName("ball")
    moment = 0.4 * ball.mass_kg * ball.radius_m**2
    body.setInertia(dartpy.dynamics.Inertia(ball.mass_kg, np.zeros(3), np.eye(3) * moment))
    node = body.createShapeNode(dartpy.dynamics.SphereShape(ball.radius_m))
    node.createCollisionAspect()
    surface = node.createDynamicsAspect()
    surface.setRestitutionCoeff(1.0)
    surface.setFrictionCoeff(cup.friction)
    return skeleton
