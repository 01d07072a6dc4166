"""A primitive whose end is moved while the ball flies: what tau cannot reach, the place of the catch can."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion import minimum_jerk
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.catch.path_response import SHARE, weights_of


def shifted_plan(plan: MotionPlan, shift_m: tuple[float, float], flight: tuple[float, float]) -> MotionPlan:
    """The primitive with its goal moved by ``shift_m`` along x and y, and the way there made during ``flight``.

    ``flight`` is the share of the motion, from 0 to 1, in which the rope is slack. The way is a step of minimum jerk

        d s^3 (10 - 15 s + 6 s^2),   s from 0 to 1 over the flight.

    Coordinates that the motion has not are not shifted.
    """
    wanted = minimum_jerk.step((SHARE - flight[0]) / max(flight[1] - flight[0], 1e-3))
    change = weights_of(plan, wanted[None], np.ones(1))[0]
    step: Array = np.array([dict(zip("xy", shift_m, strict=True)).get(name, 0.0) for name in plan.coordinates])
    return dataclasses.replace(plan, goal_m=plan.goal_m + step, weights=plan.weights + step[:, None] * change[None, :])
