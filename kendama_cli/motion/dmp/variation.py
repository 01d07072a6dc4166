"""Variation of the demonstrations of one task: the average primitive as a distribution over parameters."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.schema.arrays import Array


def parameters(plan: MotionPlan) -> Array:
    """Return log T, start rate, goal - start, goal rate (a rate is velocity x T) and weights; (1 + c (3 + m),)."""
    return np.concatenate(
        (
            [np.log(plan.duration_s)],
            plan.start_velocity_m_s * plan.duration_s,
            plan.goal_m - plan.start_m,
            plan.goal_velocity_m_s * plan.duration_s,
            plan.weights.ravel(),
        )
    )


def with_parameters(plan: MotionPlan, values: Array) -> MotionPlan:
    """Return ``plan`` with the parameters ``values``, in the order of ``parameters``."""
    c = len(plan.coordinates)
    duration = float(np.exp(values[0]))
    start_rate, way, goal_rate = values[1 : 1 + 3 * c].reshape(3, c)
    return dataclasses.replace(
        plan,
        duration_s=duration,
        start_velocity_m_s=start_rate / duration,
        goal_m=plan.start_m + way,
        goal_velocity_m_s=goal_rate / duration,
        weights=values[1 + 3 * c :].reshape(plan.weights.shape),
    )


def covariance(plan: MotionPlan) -> Array:
    """Return the covariance of the parameters over the demonstrations that ``plan`` averages; zeros for one."""
    made: Array = plan.variation.T @ plan.variation
    return made


def sample_plan(plan: MotionPlan, rng: np.random.Generator, scale: float = 1.0) -> MotionPlan:
    """Sample a swing from the normal distribution with mean ``plan`` and ``scale``^2 times its covariance.

    The parameters vary together as they did over the demonstrations, so what is drawn is again a swing of their kind.
    """
    drawn = rng.standard_normal(len(plan.variation)) @ plan.variation
    return dataclasses.replace(
        with_parameters(plan, parameters(plan) + scale * drawn), variation=np.zeros((0, plan.variation.shape[1]))
    )
