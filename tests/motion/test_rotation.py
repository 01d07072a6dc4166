"""Quaternions and rotation vectors against scipy's rotations, and where angles are tiny or beyond half a turn."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from kendama_cli.motion.rotation import (
    between,
    continuous_logarithm,
    cross,
    exp_of,
    exponential,
    inverse,
    log_of,
    logarithm,
    mapped,
    matrix_of,
    multiply,
    quaternion_of,
    rotated,
)
from kendama_cli.schema.arrays import Array

RNG = np.random.default_rng(9)
A, B = (q / np.linalg.norm(q, axis=1, keepdims=True) for q in RNG.normal(size=(2, 60, 4)))


def scipys(rotation_wxyz: Array) -> Rotation:
    return Rotation.from_quat(rotation_wxyz[..., [1, 2, 3, 0]])


def test_products_inverses_and_rotated_vectors_are_scipys() -> None:
    vector = np.array([0.3, -1.2, 0.7])
    assert matrix_of(multiply(A, B)) == pytest.approx((scipys(A) * scipys(B)).as_matrix(), abs=1e-14)
    assert np.array_equal(multiply(A[:4, None], B[None, :3])[2, 1], multiply(A[2], B[1]))
    assert matrix_of(inverse(A)) == pytest.approx(scipys(A).inv().as_matrix(), abs=1e-14)
    assert rotated(A, vector) == pytest.approx(scipys(A).apply(vector), abs=1e-14)
    assert np.array_equal(cross(A[:, 1:], vector), np.cross(A[:, 1:], vector))


def test_vectors_matrices_and_quaternions_are_maps_of_each_other() -> None:
    vectors = RNG.normal(size=(60, 3))
    vectors *= RNG.uniform(0, 3.1, (60, 1)) / np.linalg.norm(vectors, axis=1, keepdims=True)
    assert matrix_of(exponential(vectors)) == pytest.approx(Rotation.from_rotvec(vectors).as_matrix(), abs=1e-14)
    assert logarithm(A) == pytest.approx(scipys(A).as_rotvec(), abs=1e-12)
    assert np.array_equal(logarithm(A), logarithm(-A))
    assert matrix_of(3.0 * A[5]) == pytest.approx(scipys(A[5]).as_matrix(), abs=1e-14)
    for one in (*np.eye(4), *A, *(np.eye(4)[[0, 1, 2, 3, 0]] + 0.02 * A[:5])):  # each element the largest
        unit = one / np.linalg.norm(one)
        quaternion = quaternion_of(matrix_of(one))
        assert quaternion * np.sign(quaternion @ unit) == pytest.approx(unit, abs=1e-14)
        assert quaternion[0] >= 0.0
    for one in vectors:
        assert log_of(exp_of(one)) == pytest.approx(one, abs=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 3e-8, 1e-6, 1e-4])
def test_small_rotations_keep_their_digits(angle: float) -> None:
    vector = angle * np.array([[0.6, 0.0, 0.8]])
    assert np.allclose(logarithm(exponential(vector)), vector, rtol=1e-14, atol=1e-22)


@pytest.mark.parametrize("determinant", [1, -1])
def test_a_rotation_in_other_axes_turns_the_places_of_those_axes(determinant: int) -> None:
    """The map M takes places there; turning before it and after it lead to the same place, whichever hand M has."""
    matrix = determinant * matrix_of(B[0])
    place = np.array([0.2, 0.5, -0.4])
    for one, other in zip(A, mapped(A, matrix, determinant), strict=True):
        assert matrix_of(other) @ (matrix @ place) == pytest.approx(matrix @ (matrix_of(one) @ place), abs=1e-14)


def test_between_two_samples_a_rotation_goes_the_short_way_at_nearly_a_constant_rate() -> None:
    t_s = np.cumsum(RNG.uniform(0.05, 0.2, 30))
    angle = 0.4
    steps = exponential(angle * np.array([one / np.linalg.norm(one) for one in RNG.normal(size=(30, 3))]))
    rotation = [steps[0]]
    for step in steps[1:]:
        rotation.append(multiply(step, rotation[-1]))
    flips = RNG.choice([-1.0, 1.0], (30, 1))
    at_s = np.linspace(t_s[0], t_s[-1], 500)
    made = scipys(between(t_s, flips * np.array(rotation), at_s))
    off = (made.inv() * Slerp(t_s, scipys(np.array(rotation)))(at_s)).magnitude()
    assert 0.5 * angle**3 / 240 < off.max() < 1.05 * angle**3 / 240
    assert between(t_s, np.array(rotation), np.array([-1.0, 99.0])) == pytest.approx(np.array(rotation)[[0, -1]])


@pytest.mark.parametrize(("back", "samples"), [(1.0, 221), (-1.0, 221), (1.0, 6)])
def test_a_turn_beyond_half_a_revolution_makes_no_jump(back: float, samples: int) -> None:
    """Beyond a whole one too, where the rotation is none, and back; by nearly half a turn from sample to sample too."""
    there = back * np.linspace(0, 4.4 * np.pi, samples)
    angles = np.concatenate([there, there[::-1]])[:, None]
    axis = np.array([[0.0, 0.6, 0.8]])
    flips = RNG.choice([-1.0, 1.0], angles.shape)
    assert continuous_logarithm(flips * exponential(angles * axis)) == pytest.approx(angles * axis, abs=1e-9)
    assert samples == 6 or math.remainder(float(angles[100, 0]), 2 * math.pi) == pytest.approx(0.0, abs=1e-12)
