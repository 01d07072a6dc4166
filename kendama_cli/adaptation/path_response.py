"""How a primitive's weights make its path follow a wanted displacement."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.schema.arrays import Array

SAMPLES = 500
RIDGE = 1e-9
"""Relative weight of the parameters' size in the fit: it only keeps basis functions that move nothing at rest."""
SHARE: Array = np.linspace(0.0, 1.0, SAMPLES)
"""Where in the motion a displacement is given, from its start at 0 to its end at 1."""


def weights_of(plan: MotionPlan, wanted_m: Array, goal_m: Array) -> Array:
    """Weights (k, m) that displace a coordinate of ``plan`` by ``wanted_m`` (k, SAMPLES), its goal by ``goal_m`` (k,).

    A primitive's place is linear in goal and weights (docs/equations.md eq. 3), so that least squares find them.
    """
    m = len(plan.centers)
    t_s = SHARE * plan.duration_s
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
    pulled = play(dataclasses.replace(still, weights=np.zeros((m, m)), goal_m=np.ones(m)), t_s).position_m[:, 0]
    scale = np.linalg.norm(response, axis=0)
    unit = response / scale
    left = wanted_m.T - np.outer(pulled, goal_m)
    found: Array = np.linalg.solve(unit.T @ unit + RIDGE * np.eye(m), unit.T @ left) / scale[:, None]
    return found.T
