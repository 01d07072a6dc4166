"""Searches of a few parameters: they find what is cheap, by the costs alone, and go on where they were cut off."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.learning.parameter_search import ParameterSearch, PowerSearch, parameter_search

DIMENSION, GENERATION = 6, 6
GOAL = np.array([1.5, -1.0, 0.5, 0.0, -0.5, 1.0])


def searching(kind: str, seed: int = 10000) -> ParameterSearch:
    return parameter_search(kind, DIMENSION, seed, generation=GENERATION, elite=5, reward_cost=0.3)  # type: ignore[arg-type]


def far(place: np.ndarray) -> float:
    return float(np.linalg.norm(place - GOAL))


def costs_of(kind: str, generations: int, seed: int = 10000) -> list[list[float]]:
    costs: list[list[float]] = []
    for _ in range(generations):
        costs.append([far(one) for one in searching(kind, seed).after(costs).proposals])
    return costs


@pytest.mark.parametrize("kind", ["cma", "power"])
def test_a_search_comes_nearer_than_chance_does(kind: str) -> None:
    """Twenty generations from 2.2 away. Seeds 10000 to 10009, median: 0.3 (cma) and 0.6 (power), chance 1.4."""
    reached, chance = (
        np.median([far(searching(name, seed).after(costs_of(name, 20, seed)).best) for seed in range(10000, 10005)])
        for name in (kind, "random")
    )
    assert reached < 0.8 * chance
    assert reached < 1.0


@pytest.mark.parametrize("kind", ["cma", "power", "random"])
def test_what_comes_next_follows_from_the_costs_alone(kind: str) -> None:
    costs = costs_of(kind, 4)
    one, same = searching(kind).after(costs), searching(kind).after(costs)
    assert one.proposals.tobytes() == same.proposals.tobytes()
    assert one.best.tobytes() == same.best.tobytes()
    assert one.proposals.shape == (GENERATION, DIMENSION)
    assert searching(kind, 10001).after([]).proposals.tolist() != searching(kind).after([]).proposals.tolist()


@pytest.mark.parametrize("kind", ["cma", "power", "random"])
def test_a_search_begins_at_zero_and_leaves_numpys_global_state_alone(kind: str) -> None:
    before = np.random.get_state()[1].tobytes()  # type: ignore[index,union-attr]  # noqa: NPY002
    assert searching(kind).after([]).best.tolist() == [0.0] * DIMENSION
    searching(kind).after(costs_of(kind, 3))
    assert np.random.get_state()[1].tobytes() == before  # type: ignore[index,union-attr]  # noqa: NPY002


def test_power_takes_the_mean_of_its_best_rollouts_by_their_rewards() -> None:
    search = PowerSearch(2, 4, 10000, elite=2, reward_cost=0.5)
    first = search.after([]).proposals
    rewards = np.exp([-0.1 / 0.5, -0.3 / 0.5])
    desired = (rewards[0] * first[2] + rewards[1] * first[0]) / rewards.sum()
    assert search.after([[0.3, 0.9, 0.1, 0.7]]).best == pytest.approx(desired)


def test_power_stands_costs_whose_rewards_vanish() -> None:
    assert np.isfinite(PowerSearch(2, 4, 0, elite=2, reward_cost=1e-3).after([[9.0, 8.0, 7.0, 6.0]]).best).all()


def test_chance_keeps_the_best_rollout_of_all() -> None:
    search = searching("random")
    first, second = search.after([]).proposals, search.after([[1.0] * GENERATION]).proposals
    assert search.after([[5.0, 4.0, 3.0, 2.0, 1.0, 6.0]]).best.tolist() == first[4].tolist()
    later = [[5.0] * GENERATION, [6.0, 4.0, 6.0, 6.0, 6.0, 6.0]]
    state = search.after(later)
    assert state.best.tolist() == second[1].tolist()
    assert not {tuple(one) for one in state.proposals} & {tuple(one) for one in (*first, *second)}
