"""A primitive whose end is moved while the ball flies: what tau cannot reach, the place of the catch can."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion import minimum_jerk
from kendama_cli.motion.dmp import play
from kendama_cli.schema.arrays import Array

SAMPLES = 500
RIDGE = 1e-9
"""Relative weight of the parameters' size in the fit: it only keeps basis functions that move nothing at rest."""


def shifted_plan(plan: MotionPlan, shift_m: tuple[float, float], flight: tuple[float, float]) -> MotionPlan:
    """The primitive with its goal moved by ``shift_m`` along x and y, and the way there made during ``flight``.

    ``flight`` is the share of the motion, from 0 to 1, in which the rope is slack. A primitive's place is linear in
    goal and weights (docs/equations.md eq. 3), so the weights are fitted by least squares to a step of minimum jerk

        d s^3 (10 - 15 s + 6 s^2),   s from 0 to 1 over the flight.

    Coordinates that the motion has not are not shifted.
    """
    m = len(plan.centers)
    share = np.linspace(0.0, 1.0, SAMPLES)
    t_s = share * plan.duration_s
    names = tuple(f"w{j}" for j in range(m))
    still = dataclasses.replace(
        plan,
        coordinates=names,
        tau_scale=1.0,
        start_m=np.zeros(m),
        start_velocity_m_s=np.zeros(m),
        goal_m=np.zeros(m),
        goal_velocity_m_s=np.zeros(m),
        variation=np.zeros((0, 1 + m * (3 + m))),
        weights=np.eye(m),
    )
    response = play(still, t_s).position_m
    pulled = play(dataclasses.replace(still, weights=np.zeros((m, m)), goal_m=np.ones(m)), t_s).position_m[:, 0]
    wanted = minimum_jerk.step((share - flight[0]) / max(flight[1] - flight[0], 1e-3)) - pulled
    scale = np.linalg.norm(response, axis=0)
    unit = response / scale
    change = np.linalg.solve(unit.T @ unit + RIDGE * np.eye(m), unit.T @ wanted) / scale
    step: Array = np.array([dict(zip("xy", shift_m, strict=True)).get(name, 0.0) for name in plan.coordinates])
    return dataclasses.replace(plan, goal_m=plan.goal_m + step, weights=plan.weights + step[:, None] * change[None, :])
