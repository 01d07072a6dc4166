"""What is so in the world of a simulated robot, without noise or delay: for logs, pictures and comparisons."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.devices.robot.interface import BodyPose, ContactTruth, SceneState
from kendama_cli.simulation.dart.world import ArmWorld


def true_scene(world: ArmWorld) -> SceneState:
    """Joints, cup and ball of a game."""
    place = world.body.cup.getWorldTransform()
    return SceneState(
        np.array(world.position_rad),
        np.array(world.ball.tie_m),
        np.array(place.rotation()),
        np.array(world.ball.position_m),
    )


def true_contact(world: ArmWorld, moving: Sequence[str]) -> ContactTruth:
    """What the probe touches, and where the scene's ``moving`` bodies are."""
    places = [(name, world.scene.bodies[name].getWorldTransform()) for name in moving]
    poses = [BodyPose(name, np.array(one.translation()), np.array(one.rotation())) for name, one in places]
    return ContactTruth(world.sensor.touched, tuple(poses))
