"""Few parameters of a motion searched in generations of rollouts: which to try next, as a function of the costs so far.

Nothing is remembered but the costs, so that a search that was cut off goes on exactly where it stood. Parameters are in
units of their first standard deviation and begin at zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class Generation:
    """State of the search: the ``best`` parameters so far (d,), and the ``proposals`` (n, d) to try next."""

    best: Array
    proposals: Array


class ParameterSearch(Protocol):
    """A search for the parameters of least cost."""

    def after(self, costs: Sequence[Sequence[float]]) -> Generation:
        """Return the state after the ``costs`` of every complete generation, in order; each is of n rollouts."""


class CmaSearch:
    """CMA-ES (N. Hansen, The CMA Evolution Strategy: A Tutorial, 2016) by the library ``cma``."""

    def __init__(self, dimension: int, generation: int, seed: int) -> None:
        self._dimension, self._generation, self._seed = dimension, generation, seed

    def after(self, costs: Sequence[Sequence[float]]) -> Generation:
        """Return the state after ``costs``; its best is the mean of the distribution."""
        import cma  # noqa: PLC0415 - it brings pyplot: two seconds that only those pay who choose it

        rng = np.random.default_rng(self._seed)
        options = {
            "verbose": -9,
            "popsize": self._generation,
            "seed": math.nan,  # numpy's global state is left alone
            "randn": lambda *shape: rng.standard_normal(shape),
        }
        strategy = cma.CMAEvolutionStrategy(np.zeros(self._dimension), 1.0, options)
        proposals = strategy.ask()
        for one in costs:
            strategy.tell(proposals, list(one))
            proposals = strategy.ask()
        return Generation(np.array(strategy.mean), np.array(proposals))


class PowerSearch:
    """PoWER with Gaussian exploration of a constant width (J. Kober and J. Peters, NeurIPS 2008).

        theta' = theta + sum_j r_j (theta_j - theta) / sum_j r_j,   r_j = exp(-cost_j / reward_cost)

    over the ``elite`` rollouts of least cost of all that were made (their importance sampler).
    """

    def __init__(self, dimension: int, generation: int, seed: int, *, elite: int, reward_cost: float) -> None:
        self._shape, self._seed = (generation, dimension), seed
        self._elite, self._reward_cost = elite, reward_cost

    def after(self, costs: Sequence[Sequence[float]]) -> Generation:
        """Return the state after ``costs``; its best is the mean of the exploration."""
        rng = np.random.default_rng(self._seed)
        mean = np.zeros(self._shape[1])
        attempted: list[Array] = []
        paid: list[float] = []
        proposals = mean + rng.standard_normal(self._shape)
        for one in costs:
            attempted.extend(proposals)
            paid.extend(one)
            order = np.argsort(paid, kind="stable")[: self._elite]
            cost = np.array(paid)[order]
            reward = np.exp((cost[0] - cost) / self._reward_cost)  # the common factor drops out, and with it underflow
            mean = reward @ np.array(attempted)[order] / reward.sum()
            proposals = mean + rng.standard_normal(self._shape)
        return Generation(mean, proposals)


class RandomSearch:
    """Baseline: random parameters of the same spread about the start, of which the best is kept."""

    def __init__(self, dimension: int, generation: int, seed: int) -> None:
        self._shape, self._seed = (generation, dimension), seed

    def after(self, costs: Sequence[Sequence[float]]) -> Generation:
        """Return the state after ``costs``; its best is the rollout of minimum cost."""
        rng = np.random.default_rng(self._seed)
        attempted = [rng.standard_normal(self._shape) for _ in range(len(costs) + 1)]
        if not costs:
            return Generation(np.zeros(self._shape[1]), attempted[0])
        best = int(np.argmin(np.concatenate([list(one) for one in costs])))
        return Generation(attempted[best // self._shape[0]][best % self._shape[0]], attempted[-1])


def parameter_search(
    kind: Literal["cma", "power", "random"],
    dimension: int,
    seed: int,
    *,
    generation: int,
    elite: int,
    reward_cost: float,
) -> ParameterSearch:
    """Return the search of this ``kind`` for ``dimension`` parameters."""
    if kind == "cma":
        return CmaSearch(dimension, generation, seed)
    if kind == "power":
        return PowerSearch(dimension, generation, seed, elite=elite, reward_cost=reward_cost)
    return RandomSearch(dimension, generation, seed)
