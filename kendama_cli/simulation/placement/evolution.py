"""A minimum of a function that has kinks and cliffs, by an evolution strategy that learns its covariance (CMA-ES)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class Minimum:
    """The best ``place`` (d,) in the unit cube that was seen, and the ``value`` there."""

    place: Array
    value: float


def minimise(
    cost: Callable[[Array], float], start: Array, *, spread: float, generations: int, rng: np.random.Generator
) -> Minimum:
    """Search the unit cube from ``start`` (d,) for the least ``cost``; outside, the cube is mirrored.

    The (mu/mu_w, lambda) strategy with rank-one and rank-mu updates and its usual constants (N. Hansen, The CMA
    Evolution Strategy: A Tutorial, 2016, table 1); ``spread`` is the first standard deviation.
    """
    d = len(start)
    many = 4 + int(3 * math.log(d))
    few = many // 2
    shares = math.log(few + 0.5) - np.log(np.arange(1, few + 1))
    shares /= shares.sum()
    mass = 1.0 / float((shares**2).sum())
    c_path, c_step = (4 + mass / d) / (d + 4 + 2 * mass / d), (mass + 2) / (d + mass + 5)
    c_one = 2 / ((d + 1.3) ** 2 + mass)
    c_many = min(1 - c_one, 2 * (mass - 2 + 1 / mass) / ((d + 2) ** 2 + mass))
    damping = 1 + 2 * max(0.0, math.sqrt((mass - 1) / (d + 1)) - 1) + c_step
    usual = math.sqrt(d) * (1 - 1 / (4 * d) + 1 / (21 * d * d))
    mean, step, covariance = np.array(start, dtype=np.float64), spread, np.eye(d)
    path, step_path = np.zeros(d), np.zeros(d)
    best = Minimum(_mirrored(mean), cost(_mirrored(mean)))
    for generation in range(generations):
        values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
        roots = np.sqrt(np.maximum(values, 1e-20))
        moves = rng.normal(size=(many, d)) * roots @ vectors.T
        costs = np.array([cost(_mirrored(mean + step * move)) for move in moves])
        order = np.argsort(costs, kind="stable")[:few]
        if costs[order[0]] < best.value:
            best = Minimum(_mirrored(mean + step * moves[order[0]]), float(costs[order[0]]))
        move = shares @ moves[order]
        mean = mean + step * move
        step_path = (1 - c_step) * step_path
        step_path += math.sqrt(c_step * (2 - c_step) * mass) * (vectors @ ((vectors.T @ move) / roots))
        length = float(np.linalg.norm(step_path))
        calm = length / math.sqrt(1 - (1 - c_step) ** (2 * generation + 2)) < (1.4 + 2 / (d + 1)) * usual
        path = (1 - c_path) * path + calm * math.sqrt(c_path * (2 - c_path) * mass) * move
        spread_of_best = (moves[order].T * shares) @ moves[order]
        covariance = (1 - c_one - c_many) * covariance + c_one * np.outer(path, path) + c_many * spread_of_best
        step = min(step * math.exp((c_step / damping) * (length / usual - 1)), 1.0)
    return best


def _mirrored(place: Array) -> Array:
    folded = np.mod(place, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)
