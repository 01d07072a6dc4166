"""Rotation of the cup in a demonstrated swing: encoded on the basis of the motion, and played with it.

Orientation is a rotation vector r from upright, q = exp(r); r is linear in its
weights, so demonstrations are averaged as positions are: exact for turns about one axis, and for the tilts of a swing
(up to a radian, about much the same axis) close to their mean.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan, TurnPlan
from kendama_cli.motion.dmp.averaging import Encoding
from kendama_cli.motion.dmp.encoding import fit_demonstrations
from kendama_cli.motion.dmp.onset import between
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.motion.dmp.settings import EncodeSettings
from kendama_cli.motion.rotation import continuous_logarithm, exponential, inverse, logarithm, multiply, rotated
from kendama_cli.schema.arrays import Array

TURNS = ("rx", "ry", "rz")
UP = np.array([0.0, 0.0, 1.0])


def encode_rotations(
    demonstrations: Sequence[Demonstration], encoding: Encoding, settings: EncodeSettings
) -> tuple[TurnPlan, float] | None:
    """Return the average rotation of the ``demonstrations`` behind ``encoding``, and the rms angle that is lost
    [rad].

    None where one of them has no orientation.
    """
    trimmed, first_rad = [], []
    for one, demonstration in zip(demonstrations, encoding.trimmed, strict=True):
        if one.rotation_wxyz is None:
            return None
        vectors = between(one.t_s, continuous_logarithm(one.rotation_wxyz), demonstration.t_s)
        trimmed.append(dataclasses.replace(demonstration, position_m=vectors - vectors[0]))
        first_rad.append(vectors[0])
    made, basis = fit_demonstrations(trimmed, dataclasses.replace(settings, width=(encoding.basis.width,)))
    turned = Encoding(tuple(trimmed), made, basis, TURNS)
    lost = [turned.deviation(turned.plan(i), i) for i in range(len(turned))]
    mean = turned.average()
    start = np.mean(np.array(first_rad) + made.origin_m, axis=0)
    plan = TurnPlan(start, mean.start_velocity_m_s, mean.goal_m + start, mean.goal_velocity_m_s, mean.weights)
    squares = sum(one.samples * one.rms_m**2 for one in lost)
    return plan, float(np.sqrt(squares / sum(one.samples for one in lost)))


def rotations_of(plan: MotionPlan, t_s: Array) -> Array:
    """Return the cup's rotation vectors from upright (n, 3) [rad] at ``t_s`` (n,) of ``plan``; zeros without a
    rotation.
    """
    rotation = plan.turn
    if rotation is None:
        return np.zeros((len(t_s), 3))
    motion = dataclasses.replace(
        plan,
        coordinates=TURNS,
        start_m=rotation.start_rad,
        start_velocity_m_s=rotation.start_velocity_rad_s,
        goal_m=rotation.goal_rad,
        goal_velocity_m_s=rotation.goal_velocity_rad_s,
        weights=rotation.weights,
        variation=np.zeros((0, 1 + 3 * (3 + len(plan.centers)))),
        turn=None,
    )
    return play(motion, t_s).position_m


def cup_axes(corners_rad: Array) -> Array:
    """Return the directions (n, 3) of the cup's axis when it is rotated from upright by the rotation vectors (n, 3)."""
    return rotated(exponential(corners_rad), UP)


def tilt_only(corners_rad: Array) -> tuple[Array, Array]:
    """Return the tilts [rad] of the cup's axis from upright (n,), and the rotations about that axis that they omit
    (n,).
    """
    axis = cup_axes(corners_rad)
    across = np.cross(np.broadcast_to(UP, axis.shape), axis)
    sine = np.linalg.norm(across, axis=1)
    tilt = np.arctan2(sine, axis[:, 2])
    shortest = exponential(across * (tilt / np.maximum(sine, 1e-12))[:, None])
    spin = logarithm(multiply(inverse(shortest), exponential(corners_rad)))
    return tilt, np.linalg.norm(spin, axis=1)


def with_turn_fraction(plan: MotionPlan, share: float) -> MotionPlan:
    """Return ``plan`` with its rotation scaled by ``share``; without it for 0."""
    if plan.turn is None or share == 0:
        return dataclasses.replace(plan, turn=None)
    values = {field.name: share * getattr(plan.turn, field.name) for field in dataclasses.fields(plan.turn)}
    return dataclasses.replace(plan, turn=TurnPlan(**values))
