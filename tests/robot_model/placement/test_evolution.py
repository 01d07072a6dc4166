from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.robot_model.placement.evolution import Minimum, minimise
from kendama_cli.schema.arrays import Array

RNG = np.random.default_rng(7)
TURN, _ = np.linalg.qr(RNG.normal(size=(6, 6)))
GOAL = np.array([0.2, 0.5, 0.7, 0.4, 0.6, 0.3])


def ellipsoid(place: Array) -> float:
    """Turned, and a thousand times as steep one way as another."""
    return float((10.0 ** np.linspace(0, 3, 6)) @ (TURN @ (place - GOAL)) ** 2)


def find(start: Array, seed: int = 0, generations: int = 250) -> Minimum:
    return minimise(ellipsoid, start, spread=0.2, generations=generations, rng=np.random.default_rng(seed))


def test_a_steep_turned_valley_is_followed_to_its_bottom() -> None:
    for seed in range(3):
        found = find(np.full(6, 0.9), seed)
        assert found.place == pytest.approx(GOAL, abs=1e-4)
        assert found.value == ellipsoid(found.place)


def test_a_kink_between_two_slopes_is_found() -> None:
    found = minimise(
        lambda place: float(np.abs(place - GOAL).max()),
        np.full(6, 0.5),
        spread=0.2,
        generations=200,
        rng=np.random.default_rng(1),
    )
    assert found.value < 1e-3


def test_nothing_outside_the_unit_cube_is_asked_for_and_a_corner_can_be_the_answer() -> None:
    seen = []

    def toward_a_corner(place: Array) -> float:
        seen.append(place)
        return float(place.sum())

    found = minimise(toward_a_corner, np.full(4, 0.5), spread=0.5, generations=100, rng=np.random.default_rng(2))
    assert np.min(seen) >= 0.0
    assert np.max(seen) <= 1.0
    assert found.value < 0.01


def test_the_result_depends_on_its_random_stream_alone() -> None:
    one, same, other = find(GOAL + 0.1, 3, 20), find(GOAL + 0.1, 3, 20), find(GOAL + 0.1, 4, 20)
    assert one.place.tobytes() == same.place.tobytes()
    assert one.value != other.value
