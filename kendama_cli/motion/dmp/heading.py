"""The plane in which a primitive swings, and primitives that are turned about the vertical or made larger."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan, TurnPlan
from kendama_cli.motion.dmp.cup_path import AXES
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.schema.arrays import Array

SAMPLES = 500
LEAST_EXTENT_M = 1e-3
"""A path that goes less far to any side has no plane of its own."""


def heading_turn(heading_rad: float) -> Array:
    """Return the matrix (3, 3) that turns by ``heading_rad`` about the world's z."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def swing_heading_rad(plan: MotionPlan) -> float:
    """Return the angle about z from x to the horizontal direction along which ``plan`` swings.

    That is the first principal axis of its path from above, pointing where the path's third central moment is
    positive, so that the heading of a turned path is turned by as much. It is 0 for a path that goes up and down only,
    or has a coordinate that is not one of space.
    """
    if not set(plan.coordinates) <= set(AXES):
        return 0.0
    path = play(plan, plan.tau_scale * plan.duration_s * np.linspace(0.0, 1.0, SAMPLES)).position_m
    above: Array = np.zeros((SAMPLES, 2))
    for k, name in enumerate(AXES[:2]):
        if name in plan.coordinates:
            above[:, k] = path[:, plan.coordinates.index(name)]
    above -= above.mean(axis=0)
    spread, axes = np.linalg.eigh(above.T @ above / SAMPLES)
    if spread[-1] < LEAST_EXTENT_M**2:
        return 0.0
    along = axes[:, -1] * (1.0 if ((above @ axes[:, -1]) ** 3).sum() >= 0 else -1.0)
    return float(np.arctan2(along[1], along[0]))


def turned_plan(plan: MotionPlan, angle_rad: float) -> MotionPlan:
    """Return ``plan``, of coordinates of space, turned by ``angle_rad`` about z; turned at all it has all of them.

    A primitive is linear in its places, velocities and weights together (equations.md eq. 3), and so is the
    rotation vector of its cup in those of its turn.
    """
    if angle_rad == 0.0:
        return plan
    turn = heading_turn(angle_rad)[:, [AXES.index(name) for name in plan.coordinates]]
    c, rows = len(plan.coordinates), len(plan.variation)
    ends = plan.variation[:, 1 : 1 + 3 * c].reshape(rows, 3, c) @ turn.T
    weights = turn @ plan.variation[:, 1 + 3 * c :].reshape(rows, c, len(plan.centers))
    cup = plan.turn
    if cup is not None:
        whole = heading_turn(angle_rad)
        cup = TurnPlan(**{field.name: whole @ getattr(cup, field.name) for field in dataclasses.fields(cup)})
    return dataclasses.replace(
        plan,
        coordinates=AXES,
        start_m=turn @ plan.start_m,
        start_velocity_m_s=turn @ plan.start_velocity_m_s,
        goal_m=turn @ plan.goal_m,
        goal_velocity_m_s=turn @ plan.goal_velocity_m_s,
        weights=turn @ plan.weights,
        variation=np.hstack(
            (plan.variation[:, :1], ends.reshape(rows, 9), weights.reshape(rows, 3 * len(plan.centers)))
        ),
        turn=cup,
    )


def scaled_plan(plan: MotionPlan, amplitude: float, tau_scale: float) -> MotionPlan:
    """Return the primitive with its motion about the start scaled by ``amplitude``, played at ``tau_scale``.

    The equations are linear in place, goal, weights and end velocities together, so the whole path scales.
    """
    return dataclasses.replace(
        plan,
        tau_scale=tau_scale,
        start_velocity_m_s=plan.start_velocity_m_s * amplitude,
        goal_m=plan.start_m + amplitude * (plan.goal_m - plan.start_m),
        goal_velocity_m_s=plan.goal_velocity_m_s * amplitude,
        weights=plan.weights * amplitude,
        variation=np.hstack((plan.variation[:, :1], plan.variation[:, 1:] * amplitude)),
    )
