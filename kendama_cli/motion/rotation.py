"""Unit quaternions wxyz, n at once, rotation vectors and matrices: product, inverse, and the maps between them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.motion.sampling import columns_at
from kendama_cli.schema.arrays import Array

_SMALL = 1e-8
"""Below this angle [rad] a sine is its angle to the last digit."""


def multiply(first: Array, second: Array) -> Array:
    """Return the Hamilton product (..., 4): the rotation ``second``, then ``first``."""
    w1, x1, y1, z1 = np.moveaxis(np.asarray(first), -1, 0)
    w2, x2, y2, z2 = np.moveaxis(np.asarray(second), -1, 0)
    made: Array = np.stack(
        (
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        ),
        axis=-1,
    )
    return made


def inverse(rotation_wxyz: Array) -> Array:
    """Return the inverse of unit quaternions (..., 4)."""
    made: Array = np.asarray(rotation_wxyz) * np.array([1.0, -1.0, -1.0, -1.0])
    return made


def rotated(rotation_wxyz: Array, vector: Array) -> Array:
    """Return a vector (3,) rotated by unit quaternions (n, 4), q = (w, u): r + 2 u x (u x r + w r); (n, 3)."""
    w, u = rotation_wxyz[:, :1], rotation_wxyz[:, 1:]
    return np.asarray(vector + 2 * cross(u, cross(u, vector) + w * vector))


def mapped(rotation_wxyz: Array, matrix: Array, determinant: int) -> Array:
    """Return quaternions (n, 4) in the axes to which an orthogonal M (3, 3) maps places.

    A turn R becomes M R M^T, which turns by det(M) times the same angle about M times its axis. ``determinant`` (1 or
    -1) is of the whole map from the source's axes, of which M may be the last part.
    """
    return np.hstack([rotation_wxyz[:, :1], determinant * rotation_wxyz[:, 1:] @ matrix.T])


def between(t_s: Array, rotation_wxyz: Array, at_s: Array) -> Array:
    """Return the rotations (k, 4) at ``at_s`` (k,) between those (n, 4) at ``t_s`` (n,): normalised means.

    On the shorter way from one to the next (E. Lengyel, Mathematics for 3D Game Programming, 2011, 4.6.3); held beyond
    both ends. Over the angle a between two samples it strays by a^3 / 240 at most from the turn at a constant rate.
    """
    rotation = np.array(rotation_wxyz, dtype=np.float64)
    rotation[1:] *= np.cumprod(np.where((rotation[1:] * rotation[:-1]).sum(axis=1) < 0, -1.0, 1.0))[:, None]
    made = columns_at(at_s, t_s, rotation)
    return np.asarray(made / np.linalg.norm(made, axis=1, keepdims=True))


def exponential(vector_rad: Array) -> Array:
    """Return the rotation about ``vector_rad`` (..., 3) by its length, as a unit quaternion (..., 4)."""
    vector = np.asarray(vector_rad, dtype=np.float64)
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    half = np.where(angle < _SMALL, 0.5, np.sin(angle / 2) / np.maximum(angle, _SMALL))
    made: Array = np.concatenate((np.cos(angle / 2), half * vector), axis=-1)
    return made


def logarithm(rotation_wxyz: Array) -> Array:
    """Return the rotation vector (..., 3) of unit quaternions (..., 4), at most pi long: q and -q give the same."""
    q = np.asarray(rotation_wxyz, dtype=np.float64)
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    factor = np.where(sine < _SMALL, 2.0, angle / np.maximum(sine, _SMALL))
    return np.asarray(factor * q[..., 1:])


def continuous_logarithm(rotation_wxyz: Array) -> Array:
    """Return the rotation vectors (n, 3) of successive orientations (n, 4), each on the branch nearest the one
    before.

    So neither a flip of the quaternion's sign nor a turn beyond pi makes a jump.
    """
    vectors = logarithm(rotation_wxyz)
    made = vectors.copy()
    for i in range(1, len(made)):
        angle = float(np.linalg.norm(vectors[i]))
        before = float(np.linalg.norm(made[i - 1]))
        axis = vectors[i] / angle if angle > _SMALL else made[i - 1] / max(before, _SMALL)
        rotations = np.round((made[i - 1] @ axis - angle) / (2 * np.pi))
        made[i] = vectors[i] + 2 * np.pi * rotations * axis
    return made


def cross(a: Array, b: Array) -> Array:
    """Return a x b (..., 3) of vectors (..., 3): the numbers of ``np.cross``, which takes ten times as long."""
    made = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i in range(3):
        made[..., i] = a[..., i - 2] * b[..., i - 1] - a[..., i - 1] * b[..., i - 2]
    return made


def quaternion_of(rotation: Array) -> Array:
    """Return the unit quaternion (4,) with w >= 0 of a rotation matrix (3, 3), by its maximum element (Shepperd
    1978).
    """
    r = rotation
    squares = [
        1 + r[0, 0] + r[1, 1] + r[2, 2],
        1 + r[0, 0] - r[1, 1] - r[2, 2],
        1 - r[0, 0] + r[1, 1] - r[2, 2],
        1 - r[0, 0] - r[1, 1] + r[2, 2],
    ]
    maximum = int(np.argmax(squares))
    rows = (
        (squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]),
        (r[2, 1] - r[1, 2], squares[1], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0]),
        (r[0, 2] - r[2, 0], r[1, 0] + r[0, 1], squares[2], r[2, 1] + r[1, 2]),
        (r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], squares[3]),
    )
    q = np.array(rows[maximum]) / (2 * math.sqrt(squares[maximum]))
    return q if q[0] >= 0 else -q


def matrix_of(rotation_wxyz: ArrayLike) -> Array:
    """Return the rotation matrix (3, 3) of a quaternion (4,), or (n, 3, 3) of (n, 4); quaternions are normalised
    first.
    """
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
    """Return the rotation vector (3,) [rad] of a rotation matrix (3, 3), at most pi long."""
    return logarithm(quaternion_of(rotation))


def exp_of(vector_rad: ArrayLike) -> Array:
    """Return the rotation matrix (3, 3) of a rotation vector (3,) [rad]: the inverse of ``log_of``."""
    return matrix_of(exponential(np.asarray(vector_rad, dtype=np.float64)))
