"""Demonstrations that stand apart, and those recorded along other axes."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.motion.dmp.averaging import apart, axes_of
from kendama_cli.schema.arrays import Array
from tests.motion.swings import path

T = np.linspace(0, 2, 101)


def swings(count: int, seed: int, spread: float = 0.05) -> Array:
    rng = np.random.default_rng(seed)
    return np.array([(1 + spread * rng.standard_normal(3)) * (path(T) - path(T)[0]) for _ in range(count)])


@pytest.mark.parametrize("count", [4, 6, 10, 20])
def test_alike_demonstrations_are_all_kept(count: int) -> None:
    """200 sets: less than one demonstration in a hundred is taken for an outlier (measured: none of 12 000)."""
    counts = [apart(swings(count, seed), np.full(count, 2.0)).sum() for seed in range(200)]
    assert np.mean(counts) / count < 0.01


def test_a_swing_of_another_kind_stands_apart_and_only_it() -> None:
    paths = swings(10, 1)
    paths[4, :, 2] += 0.2 * np.sin(2 * np.pi * T)
    assert list(np.flatnonzero(apart(paths, np.full(10, 2.0)))) == [4]


def test_a_swing_of_twice_the_duration_stands_apart() -> None:
    durations = np.array([2.0, 2.1, 1.9, 2.05, 4.0, 1.95])
    assert list(np.flatnonzero(apart(swings(6, 2), durations))) == [4]


def test_differences_of_a_millimetre_are_nobodys_fault() -> None:
    paths = np.repeat(swings(1, 3), 6, axis=0)
    paths[2] += 1e-3 * np.sin(5 * T)[:, None]
    assert not apart(paths, np.full(6, 2.0)).any()


def test_of_three_nobody_stands_apart() -> None:
    paths = swings(3, 4)
    paths[0] *= -1
    assert not apart(paths, np.full(3, 2.0)).any()


@pytest.mark.parametrize(
    ("read", "sentence"),
    [
        (lambda p: p * [-1, 1, 1], "x is its -x"),
        (lambda p: p[:, [2, 1, 0]], "x is its z, z is its x"),
        (lambda p: p[:, [1, 0, 2]], "x is its y"),
        (lambda p: p[:, [1, 2, 0]] * [1, -1, 1], "x is its z, z is its -y"),
    ],
)
def test_other_axes_are_recognised_and_named(read, sentence) -> None:  # type: ignore[no-untyped-def]
    paths = swings(6, 5)
    found = axes_of(read(paths[0]), list(paths[1:]), "xyz")
    assert found is not None
    assert sentence in found


def test_axes_that_agree_and_swings_of_another_kind_are_left_alone() -> None:
    paths = swings(6, 6)
    assert axes_of(paths[0], list(paths[1:]), "xyz") is None
    other = 0.3 * np.column_stack([np.sin(9 * T), 0 * T, np.cos(13 * T)])
    assert axes_of(other, list(paths[1:]), "xyz") is None


def test_where_the_others_do_not_agree_nobody_is_told_about_axes() -> None:
    paths = swings(3, 7)
    paths[1] *= -1
    assert axes_of(-paths[0], [*paths], "xyz") is None
