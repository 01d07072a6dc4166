"""Quaternions and rotation vectors: the laws of the group, and the maps between them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.motion.rotation import (
    continuous_logarithm,
    exp_of,
    exponential,
    inverse,
    log_of,
    logarithm,
    matrix_of,
    multiply,
    quaternion_of,
)

RNG = np.random.default_rng(9)
A, B, C = (q / np.linalg.norm(q, axis=1, keepdims=True) for q in RNG.normal(size=(3, 50, 4)))
ONE = np.array([1.0, 0.0, 0.0, 0.0])


def test_the_product_is_associative_with_one_and_inverses() -> None:
    assert np.allclose(multiply(multiply(A, B), C), multiply(A, multiply(B, C)), atol=1e-14)
    assert np.allclose(multiply(A, ONE), A, atol=0)
    assert np.allclose(multiply(A, inverse(A)), ONE, atol=1e-15)
    assert np.allclose(inverse(multiply(A, B)), multiply(inverse(B), inverse(A)), atol=1e-15)


def test_products_stay_of_unit_length() -> None:
    assert np.allclose(np.linalg.norm(multiply(A, B), axis=1), 1, atol=1e-15)


def test_exponential_and_logarithm_undo_each_other() -> None:
    vectors = RNG.normal(size=(50, 3))
    vectors *= RNG.uniform(0, np.pi - 1e-6, (50, 1)) / np.linalg.norm(vectors, axis=1, keepdims=True)
    assert np.allclose(logarithm(exponential(vectors)), vectors, atol=1e-9)
    back = exponential(logarithm(A))
    assert np.allclose(back * np.sign(np.sum(back * A, axis=1, keepdims=True)), A, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1e-6, 1e-4])
def test_small_rotations_keep_their_digits(angle: float) -> None:
    vector = angle * np.array([[0.6, 0.0, 0.8]])
    assert np.allclose(logarithm(exponential(vector)), vector, rtol=1e-10, atol=1e-22)


def test_a_quaternion_and_its_negative_are_one_rotation() -> None:
    assert np.allclose(logarithm(A), logarithm(-A), atol=1e-15)


def test_rotations_about_one_axis_add_up() -> None:
    axis = np.array([[0.0, 0.6, 0.8]])
    assert np.allclose(multiply(exponential(0.7 * axis), exponential(0.5 * axis)), exponential(1.2 * axis), atol=1e-15)


def test_a_turn_beyond_half_a_revolution_makes_no_jump() -> None:
    angles = np.linspace(0, 1.8 * np.pi, 100)[:, None]
    axis = np.array([[0.0, 0.6, 0.8]])
    flips = RNG.choice([-1.0, 1.0], (100, 1))
    made = continuous_logarithm(flips * exponential(angles * axis))
    assert np.allclose(made, angles * axis, atol=1e-9)


RNG = np.random.default_rng(1)


def test_log_undoes_exp_up_to_half_a_turn():
    for length in (0.0, 1e-9, 1e-4, 0.5, 2.0, 3.0, math.pi - 1e-6):
        for axis in RNG.normal(size=(20, 3)):
            vector = length * axis / np.linalg.norm(axis)
            assert log_of(exp_of(vector)) == pytest.approx(vector, abs=1e-9 if length < 3 else 1e-7)


def test_exp_is_the_turn_of_rodrigues_formula():
    for vector in RNG.normal(size=(20, 3)):
        angle = np.linalg.norm(vector)
        x, y, z = vector / angle
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        desired = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
        assert exp_of(vector) == pytest.approx(desired, abs=1e-14)


def test_a_quaternion_and_its_matrix_are_the_same_turn_whichever_element_is_largest():
    for quaternion in [*np.eye(4), *RNG.normal(size=(200, 4))]:
        unit = quaternion / np.linalg.norm(quaternion)
        unit = unit if unit[0] >= 0 else -unit
        matrix = matrix_of(3.0 * quaternion)
        assert matrix @ matrix.T == pytest.approx(np.eye(3), abs=1e-14)
        assert np.linalg.det(matrix) == pytest.approx(1.0)
        assert abs(float(quaternion_of(matrix) @ unit)) == pytest.approx(1.0, abs=1e-14)
