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
    """Search the unit cube from ``start`` (d,) for the least ``cost`` by the library ``cma``; outside it is mirrored.

    ``spread`` is the first standard deviation.
    """
    import cma  # noqa: PLC0415 - it brings pyplot: two seconds that only a search pays

    options = {
        "verbose": -9,
        "seed": math.nan,  # numpy's global state is left alone
        "randn": lambda *shape: rng.standard_normal(shape),
        "maxstd": 1.0,
    }
    strategy = cma.CMAEvolutionStrategy(np.asarray(start, dtype=np.float64), spread, options)
    best = Minimum(_mirrored(np.array(start)), cost(_mirrored(np.array(start))))
    for _ in range(generations):
        attempted = strategy.ask()
        found = [Minimum(position, cost(position)) for position in (_mirrored(np.array(one)) for one in attempted)]
        strategy.tell(attempted, [one.value for one in found])
        best = min(best, *found, key=lambda one: one.value)
    return best


def _mirrored(place: Array) -> Array:
    folded = np.mod(place, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)
