"""The rope's force law (PAPER.md eq. 1)."""

from __future__ import annotations

import math


def rope_force(  # noqa: PLR0917 - plain numbers, for this runs in every step
    x: float,
    y: float,
    z: float,
    vx: float,
    vy: float,
    vz: float,
    length_m: float,
    stiffness_n_m: float,
    damping_n_s_m: float,
) -> tuple[float, float, float] | None:
    """The force on the ball [N], or None where the rope is slack; the tie point feels the opposite.

        f_r = -(Ks d + Kd d') h  if d > 0, else 0;   d = l - l0          (PAPER.md eq. 1)

    ``x y z`` and ``vx vy vz`` are the ball's place and velocity relative to the tie point, h points from the tie point
    to the ball. A rope never pushes: where damping would outweigh the spring on the way in, the force is zero.
    """
    square = x * x + y * y + z * z
    if square <= length_m * length_m:
        return None
    length = math.sqrt(square)
    pull = stiffness_n_m * (length - length_m) + damping_n_s_m * (x * vx + y * vy + z * vz) / length
    if pull <= 0.0:
        return None
    k = -pull / length
    return (k * x, k * y, k * z)
