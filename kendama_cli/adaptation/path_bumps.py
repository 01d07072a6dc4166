"""A primitive whose path is bent by a few smooth bumps: what a search of its shape varies."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.adaptation.path_response import SHARE, weights_of
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion import minimum_jerk
from kendama_cli.schema.arrays import Array

ALONG = ("x", "z")
"""The swing's plane; a ball that comes down beside it is met by the goal."""

ENDS = 0.15
"""Within this share of the motion at either end a bump is taken to nothing, so that start and goal stay."""


def bumps(count: int) -> Array:
    """The ``count`` bumps (count, SAMPLES), of height 1 but near the ends: Gaussians as wide as they are apart.

        b_i(s) = exp(-(s - c_i)^2 / (2 w^2)) e(s),   c_i = i w,  w = 1 / (count + 1)

    with e rising from 0 and falling back to it within ENDS, by the step of minimum jerk.
    """
    width = 1.0 / (count + 1)
    centres = width * np.arange(1, count + 1)[:, None]
    ends = minimum_jerk.step(SHARE / ENDS) * minimum_jerk.step((1.0 - SHARE) / ENDS)
    return np.asarray(np.exp(-0.5 * ((SHARE - centres) / width) ** 2) * ends)


def bumped_plan(plan: MotionPlan, heights_m: tuple[float, ...]) -> MotionPlan:
    """The primitive with its path displaced by bumps of these heights, those along x first, then as many along z.

    Coordinates that the motion has not are not displaced.
    """
    height = np.reshape(heights_m, (len(ALONG), -1))
    shape = bumps(height.shape[1])
    change = weights_of(plan, height @ shape, np.zeros(len(ALONG)))
    weights = np.array(plan.weights)
    for row, name in zip(change, ALONG, strict=True):
        if name in plan.coordinates:
            weights[plan.coordinates.index(name)] += row
    return dataclasses.replace(plan, weights=weights)
