"""How long a moving disc covers each pixel, and with which parts of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kendama_cli.schema.arrays import Array

NODES = (-0.5, -0.25, 0.0, 0.25, 0.5)
WEIGHTS = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 12
"""Simpson's rule across the blur."""
WIDER = 1.05


class MovingDisc(NamedTuple):
    """How far it moves within the exposure, its radius, and the width of the box that blurs its edges."""

    length: float
    radius: float
    blur: float


def moments(x: Array, y: Array, disc: MovingDisc, degree: int) -> tuple[Array, Array]:
    """The cover (the part of the exposure) and its moments up to ``degree``, (k, n), and their slopes (5, k, n).

    A ``disc`` moves evenly along x, its middle at 0 at mid-exposure. It covers (x, y) with what lies between
    lo = q(x - length/2) and hi = q(x + length/2) on its chord, where q clips to the chord's half, sqrt(radius^2 - y^2):
    the moment of degree (i, j) is (y/radius)^j times the integral of (u/radius)^i du / length from lo to hi, (0, 0)
    first. All is blurred by a box. Slopes are along x, y, length, radius and blur.
    """
    length, radius, blur = disc
    values, (b_x, b_y, b_length) = _moments(x, y, disc, degree)
    wider, _ = _moments(x, y, disc._replace(blur=WIDER * blur), degree)
    b_blur = (wider - values) / ((WIDER - 1) * blur)
    # scaling all lengths alike changes nothing: x f_x + y f_y + L f_L + r f_r + w f_w = 0
    b_radius = -(x * b_x + y * b_y + length * b_length + blur * b_blur) / radius
    return values, np.stack([b_x, b_y, b_length, b_radius, b_blur])


def _moments(x: Array, y: Array, disc: MovingDisc, degree: int) -> tuple[Array, Array]:
    """The moments (k, n), and their slopes (3, k, n) along x, y and length."""
    length, radius, blur = disc
    degrees = [(total - j, j) for total in range(degree + 1) for j in range(total + 1)]
    made = np.empty((len(NODES), 3, len(degrees), len(x)))
    for rows, node in zip(made, NODES, strict=True):
        shifted = y + node * blur
        chord = np.sqrt(np.maximum(radius**2 - shifted * shifted, 0.0))
        hi, hi_x = _clipped(x + length / 2, chord, blur)
        lo, lo_x = _clipped(x - length / 2, chord, blur)
        hi, lo, side = hi / radius, lo / radius, shifted / radius
        for k, (i, j) in enumerate(degrees):
            across = side**j if j else 1.0
            moment = (hi ** (i + 1) - lo ** (i + 1)) * (radius / ((i + 1) * length))
            up, down = (hi**i * hi_x, lo**i * lo_x) if i else (hi_x, lo_x)
            rows[0, k] = across * moment
            rows[1, k] = across * (up - down) / length
            rows[2, k] = across * ((up + down) / 2 - moment) / length
    value, b_x, b_length = np.tensordot(WEIGHTS, made, axes=1)
    return value, np.stack([b_x, (made[-1, 0] - made[0, 0]) / blur, b_length])


def _clipped(t: Array, chord: Array, blur: float) -> tuple[Array, Array]:
    """t clipped to -chord..chord, blurred by a box, and its slope."""
    low, low_t = _ramp(t + chord, blur)
    high, high_t = _ramp(t - chord, blur)
    return low - high - chord, low_t - high_t


def _ramp(t: Array, blur: float) -> tuple[Array, Array]:
    """max(t, 0) blurred by a box, and its slope."""
    inside = np.clip(t + blur / 2, 0.0, blur)
    return inside * inside / (2 * blur) + np.maximum(t - blur / 2, 0.0), inside / blur
