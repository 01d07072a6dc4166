"""Rotation matrices beside quaternions (wxyz) and rotation vectors, one at a time: for poses in a control loop."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.motion.rotation import exponential, logarithm
from kendama_cli.schema.arrays import Array


def quaternion_of(rotation: Array) -> Array:
    """The unit quaternion (4,) with w >= 0 of a rotation matrix (3, 3), by its largest element (Shepperd 1978)."""
    r = rotation
    squares = [
        1 + r[0, 0] + r[1, 1] + r[2, 2],
        1 + r[0, 0] - r[1, 1] - r[2, 2],
        1 - r[0, 0] + r[1, 1] - r[2, 2],
        1 - r[0, 0] - r[1, 1] + r[2, 2],
    ]
    largest = int(np.argmax(squares))
    rows = (
        (squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]),
        (r[2, 1] - r[1, 2], squares[1], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0]),
        (r[0, 2] - r[2, 0], r[1, 0] + r[0, 1], squares[2], r[2, 1] + r[1, 2]),
        (r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], squares[3]),
    )
    q = np.array(rows[largest]) / (2 * math.sqrt(squares[largest]))
    return q if q[0] >= 0 else -q


def matrix_of(rotation_wxyz: ArrayLike) -> Array:
    """The rotation matrix (3, 3) of a quaternion (4,), or those (n, 3, 3) of (n, 4), which are normalised first."""
    q = np.array(rotation_wxyz, dtype=np.float64)
    w, x, y, z = q.T / np.linalg.norm(q, axis=-1 if q.ndim > 1 else None)
    made = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return made if q.ndim == 1 else made.transpose(2, 0, 1)


def log_of(rotation: Array) -> Array:
    """The rotation vector (3,) [rad] of a rotation matrix (3, 3), at most pi long."""
    return logarithm(quaternion_of(rotation))


def exp_of(vector_rad: ArrayLike) -> Array:
    """The rotation matrix (3, 3) of a rotation vector (3,) [rad]: the inverse of ``log_of``."""
    return matrix_of(exponential(np.asarray(vector_rad, dtype=np.float64)))
