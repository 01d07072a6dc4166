"""Where the tracked ball really fell through the rim plane: what predictions are held against."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.physics.rim_crossing import falls
from kendama_cli.schema.arrays import Array

FEWEST_SAMPLES = 20
"""Samples from which a parabola is fitted."""


@dataclass(frozen=True)
class Crossing:
    """When and where (3,) the ball really fell through the rim plane."""

    t_s: float
    place_m: Array


def find_crossing(path: Array, height_m: float, free_s: float) -> Crossing | None:
    """Where a sampled path (n, 4) of t, x, y, z first falls through ``height_m`` after ``free_s``.

    By a parabola through the samples from then on up to the crossing, which takes their noise out; on the straight
    line between the two samples about it where there are few.
    """
    path = path[path[:, 0] >= free_s]
    height = path[:, 3] - height_m
    fallen = np.flatnonzero(falls(height[:-1], height[1:]))
    if not len(fallen):
        return None
    last = int(fallen[0])
    before, after = path[last], path[last + 1]
    straight = before + (before[3] - height_m) / (before[3] - after[3]) * (after - before)
    if last < FEWEST_SAMPLES:
        return Crossing(float(straight[0]), straight[1:])
    s = path[: last + 1, 0] - before[0]
    curves = np.polynomial.polynomial.polyfit(s, path[: last + 1, 1:], 2)
    z0, fall, bend = curves[0, 2] - height_m, curves[1, 2], curves[2, 2]
    root = fall * fall - 4 * bend * z0
    if root < 0:
        return Crossing(float(straight[0]), straight[1:])
    late = (-fall - math.sqrt(root)) / (2 * bend)
    return Crossing(float(before[0] + late), curves[0] + late * (curves[1] + late * curves[2]))
