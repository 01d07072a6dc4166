"""The bodies of a scene in a DART world: boxes, cylinders, spheres and planes, fixed, free or on springs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.motion.rotation import matrix_of
from kendama_cli.plugins.interact.scene_settings import SceneBody, SceneSettings, SprungBody, StaticBody
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.schema.arrays import Array

CLEARANCE_M = 0.001
"""What stands on a body may touch it: only what is deeper inside than this overlaps."""


class Scene:
    """The bodies of ``scene``, added to the DART ``world``; ``bodies`` are DART's, by name.

    Skeletons are called ``scene <name>``, so that no body can hide a robot or a ball of the same name. The world's
    gravity and step must be set. Raises ConfigError for a body whose springs are too stiff for that step.
    """

    def __init__(self, world: Any, scene: SceneSettings) -> None:
        self.bodies: dict[str, Any] = {}
        self._springs: list[tuple[Any, float, float, Array]] = []
        for index, body in enumerate(scene.bodies):
            skeleton = dartpy.dynamics.Skeleton(f"scene {body.name}")
            self.bodies[body.name] = _make(skeleton, body)
            world.addSkeleton(skeleton)
            if isinstance(body, SprungBody):
                _check_stiffness(f"scene.bodies[{index}].stiffness_n_m", body, world.getTimeStep())
                damping = 2.0 * body.damping_ratio * math.sqrt(body.mass_kg * body.stiffness_n_m)
                weight = matrix_of(body.rotation_wxyz).T @ (body.mass_kg * np.array(world.getGravity()))
                self._springs.append((skeleton, body.stiffness_n_m, damping, weight))

    def reset(self) -> None:
        """Put every body back where the scene has it, at rest."""
        for body in self.bodies.values():
            skeleton = body.getSkeleton()
            skeleton.resetPositions()
            skeleton.resetVelocities()
            skeleton.resetAccelerations()
            skeleton.resetGeneralizedForces()

    def pull(self) -> None:
        """Set the springs' forces for the coming step: to be called before every one.

        DART's own joint springs would not do: they enter its motion implicitly, its contacts explicitly, so that a
        surface under a steady load would rest 10 % too deep.
        """
        for skeleton, stiffness, damping, weight in self._springs:
            skeleton.setForces(-stiffness * skeleton.getPositions() - damping * skeleton.getVelocities() - weight)


def depth_m(body: SceneBody, point_m: Array) -> float:
    """Return the depth of the point (3,) of the world inside ``body``, by the nearest face; negative outside [m]."""
    own = matrix_of(body.rotation_wxyz).T @ (point_m - np.array(body.position_m))
    if body.shape == "plane":
        return -float(own[2])
    if body.shape == "sphere":
        return body.size_m[0] - float(np.linalg.norm(own))
    if body.shape == "cylinder":
        radius, height = body.size_m
        over = np.array([math.hypot(own[0], own[1]) - radius, abs(own[2]) - height / 2])
    else:
        over = np.abs(own) - np.array(body.size_m) / 2
    outside = float(np.linalg.norm(np.maximum(over, 0.0)))
    return -outside if outside else -float(over.max())


def check_clear(scene: SceneSettings, base_m: Array, tool_m: Array, tool_radius_m: float) -> None:
    """Raise ConfigError, naming the body, where one holds the arm's base or its tool at home.

    ``base_m`` (k, 3) are points of the arm that never move, from its foot to its first joint.
    """
    points = [("the arm's base", point, 0.0) for point in base_m] + [("the tool at home", tool_m, tool_radius_m)]
    for index, body in enumerate(scene.bodies):
        for what, point, radius in points:
            inside_m = depth_m(body, point) + radius
            if inside_m > CLEARANCE_M:
                position = f"[{', '.join(f'{value:.3f}' for value in point)}]"
                raise ConfigError(
                    f"scene.bodies[{index}]",
                    f"'scene.bodies[{index}]' ({body.name}) overlaps with {what} by {1e3 * inside_m:.0f} mm "
                    f"at {position} m; move the body, or the arm (robot.base_position_m, robot.home_rad)",
                )


def _check_stiffness(key: str, body: SprungBody, step_s: float) -> None:
    """Raise ConfigError where w^2 dt^2 + 2 zeta w dt > 1: explicit springs are unstable from 2 to 4 on."""
    maximum = body.mass_kg * ((math.hypot(body.damping_ratio, 1.0) - body.damping_ratio) / step_s) ** 2
    if body.stiffness_n_m > maximum:
        raise ConfigError(
            key,
            f"'{key}' is {body.stiffness_n_m} for {body.name} of {body.mass_kg} kg; allowed: up to {maximum:.4g} at "
            f"steps of {step_s} s, or make the body heavier, or static",
        )


def _make(skeleton: Any, body: SceneBody) -> Any:
    if isinstance(body, StaticBody):
        joint, made = skeleton.createWeldJointAndBodyNodePair()
    elif isinstance(body, SprungBody):
        joint, made = skeleton.createTranslationalJointAndBodyNodePair()
    else:
        joint, made = skeleton.createFreeJointAndBodyNodePair()
    made.setName(body.name)
    pose = dartpy.math.Isometry3()
    pose.set_rotation(matrix_of(body.rotation_wxyz))
    pose.set_translation(np.array(body.position_m))
    # the place goes into the joint, whose positions are then 0 where the body was put
    joint.setTransformFromParentBodyNode(pose)
    shape = _shape(body)
    node = made.createShapeNode(shape)
    node.setName(f"scene {body.name}")
    node.createCollisionAspect()
    surface = node.createDynamicsAspect()
    surface.setFrictionCoeff(body.friction)
    surface.setRestitutionCoeff(body.restitution)
    if not isinstance(body, StaticBody):
        made.setInertia(dartpy.dynamics.Inertia(body.mass_kg, np.zeros(3), shape.computeInertia(body.mass_kg)))
    return made


def _shape(body: SceneBody) -> Any:
    if body.shape == "plane":
        return dartpy.dynamics.PlaneShape(np.array([0.0, 0.0, 1.0]), 0.0)
    if body.shape == "sphere":
        return dartpy.dynamics.SphereShape(body.size_m[0])
    if body.shape == "cylinder":
        return dartpy.dynamics.CylinderShape(body.size_m[0], body.size_m[1])
    return dartpy.dynamics.BoxShape(np.array(body.size_m))
