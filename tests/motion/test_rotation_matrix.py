"""Rotations: matrices, quaternions and rotation vectors tell the same turn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.motion.rotation_matrix import exp_of, log_of, matrix_of, quaternion_of

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
        wanted = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
        assert exp_of(vector) == pytest.approx(wanted, abs=1e-14)


def test_a_quaternion_and_its_matrix_are_the_same_turn_whichever_element_is_largest():
    for quaternion in [*np.eye(4), *RNG.normal(size=(200, 4))]:
        unit = quaternion / np.linalg.norm(quaternion)
        unit = unit if unit[0] >= 0 else -unit
        matrix = matrix_of(3.0 * quaternion)
        assert matrix @ matrix.T == pytest.approx(np.eye(3), abs=1e-14)
        assert np.linalg.det(matrix) == pytest.approx(1.0)
        assert abs(float(quaternion_of(matrix) @ unit)) == pytest.approx(1.0, abs=1e-14)
