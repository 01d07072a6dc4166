"""Position of the cup's tie point in a tracked body, from a motion that rotates the body about it (pivot
calibration).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.motion.rotation import inverse, logarithm, matrix_of, multiply
from kendama_cli.schema.arrays import Array

LEAST_TURN_RAD = np.radians(20)
OUTLIER = 3.0


@dataclass(frozen=True)
class Pivot:
    """``offset_m`` (3,) in the body's axes, ``pivot_m`` (3,) in the room, ``rms_m`` what is left, ``sigma_m`` (3,)."""

    offset_m: Array
    pivot_m: Array
    rms_m: float
    sigma_m: Array
    used: int


def calibrate_pivot(position_m: Array, rotation_wxyz: Array) -> Pivot:
    """Solve p + R o = c by least squares over samples (n, 3), (n, 4); outliers beyond 3 sigma are left out once.

    Raises ValueError where the body is turned too little, or about one axis only: then o is not determined.
    """
    spread = logarithm(multiply(rotation_wxyz, inverse(rotation_wxyz[0])))
    sizes = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(spread.T)), 0.0))
    if sizes[1] < LEAST_TURN_RAD / 3:
        raise ValueError(
            f"the body is turned by {np.degrees(sizes[::-1][:2]).round(1).tolist()} deg rms about its two main axes "
            "only; turn it by 30 deg or more to all sides, with the point held in place"
        )
    kept = np.ones(len(position_m), dtype=bool)
    for _ in range(2):
        system = np.zeros((3 * int(kept.sum()), 6))
        for row, rotation in enumerate(matrix_of(rotation_wxyz[kept])):
            system[3 * row : 3 * row + 3] = np.hstack((rotation, -np.eye(3)))
        target = -position_m[kept].ravel()
        found = np.asarray(np.linalg.lstsq(system, target, rcond=None)[0], dtype=np.float64)
        left = np.linalg.norm((system @ found - target).reshape(-1, 3), axis=1)
        rms_m = float(np.sqrt(np.mean(left**2)))
        used = int(kept.sum())
        sigma = np.sqrt(np.diag(np.linalg.inv(system.T @ system))[:3]) * rms_m / np.sqrt(3)
        kept[np.flatnonzero(kept)[left > OUTLIER * max(rms_m, 1e-9)]] = False
    return Pivot(found[:3], found[3:], rms_m, sigma, used)
