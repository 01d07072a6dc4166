"""Displacements of a primitive's path: smooth bumps along it, and a goal that is moved while the ball flies."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion import minimum_jerk
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.schema.arrays import Array

SAMPLES = 500
RIDGE = 1e-9
"""Relative weight of the parameters' size in the fit: it only keeps basis functions that move nothing at rest."""
PHASE: Array = np.linspace(0.0, 1.0, SAMPLES)
"""Fractions of the motion at which a displacement is given, from its start at 0 to its end at 1."""

BUMPED = ("x", "z")
"""Coordinates with bumps, the swing's plane; a ball that comes down beside it is met by the goal."""

ENDS = 0.15
"""Within this fraction of the motion at either end a bump is taken to nothing, so that start and goal stay."""


def bumps(count: int) -> Array:
    """Return ``count`` bumps (count, SAMPLES), of height 1 but near the ends: Gaussians as wide as they are apart.

        b_i(s) = exp(-(s - c_i)^2 / (2 w^2)) e(s),   c_i = i w,  w = 1 / (count + 1)

    with e rising from 0 and falling back to it within ENDS, by the step of minimum jerk.
    """
    width = 1.0 / (count + 1)
    centers = width * np.arange(1, count + 1)[:, None]
    ends = minimum_jerk.step(PHASE / ENDS) * minimum_jerk.step((1.0 - PHASE) / ENDS)
    return np.asarray(np.exp(-0.5 * ((PHASE - centers) / width) ** 2) * ends)


def bumped_plan(plan: MotionPlan, heights_m: tuple[float, ...]) -> MotionPlan:
    """Return the primitive with its path displaced by bumps of these heights, first along x, then as many along z.

    Coordinates that the motion lacks are not displaced.
    """
    height = np.reshape(heights_m, (len(BUMPED), -1))
    change = weight_changes(plan, height @ bumps(height.shape[1]), np.zeros(len(BUMPED)))
    weights = np.array(plan.weights)
    for row, name in zip(change, BUMPED, strict=True):
        if name in plan.coordinates:
            weights[plan.coordinates.index(name)] += row
    return dataclasses.replace(plan, weights=weights)


def shifted_plan(plan: MotionPlan, shift_m: tuple[float, float], flight: tuple[float, float]) -> MotionPlan:
    """Return the primitive with its goal moved by ``shift_m`` along x and y, the path there made during ``flight``.

    ``flight`` is the fraction of the motion, from 0 to 1, in which the rope is slack. The path is a step of minimum
    jerk

        d s^3 (10 - 15 s + 6 s^2),   s from 0 to 1 over the flight.

    Coordinates that the motion lacks are not shifted.
    """
    desired = minimum_jerk.step((PHASE - flight[0]) / max(flight[1] - flight[0], 1e-3))
    change = weight_changes(plan, desired[None], np.ones(1))[0]
    step: Array = np.array([dict(zip("xy", shift_m, strict=True)).get(name, 0.0) for name in plan.coordinates])
    return dataclasses.replace(plan, goal_m=plan.goal_m + step, weights=plan.weights + step[:, None] * change[None, :])


def weight_changes(plan: MotionPlan, desired_m: Array, goal_m: Array) -> Array:
    """Return weights (k, m) that displace a coordinate by ``desired_m`` (k, SAMPLES) and its goal by ``goal_m`` (k,).

    A primitive's position is linear in goal and weights (equations.md eq. 3), so that least squares find them.
    """
    m = len(plan.centers)
    t_s = PHASE * plan.duration_s
    still = dataclasses.replace(
        plan,
        coordinates=tuple(f"w{j}" for j in range(m)),
        tau_scale=1.0,
        start_m=np.zeros(m),
        start_velocity_m_s=np.zeros(m),
        goal_m=np.zeros(m),
        goal_velocity_m_s=np.zeros(m),
        variation=np.zeros((0, 1 + m * (3 + m))),
        weights=np.eye(m),
        turn=None,
    )
    response = play(still, t_s).position_m
    goal_response = play(dataclasses.replace(still, weights=np.zeros((m, m)), goal_m=np.ones(m)), t_s).position_m[:, 0]
    scale = np.linalg.norm(response, axis=0)
    unit = response / scale
    residual = desired_m.T - np.outer(goal_response, goal_m)
    found: Array = np.linalg.solve(unit.T @ unit + RIDGE * np.eye(m), unit.T @ residual) / scale[:, None]
    return found.T
