"""What every lens gives."""

from __future__ import annotations

from typing import NamedTuple

from kendama_cli.schema.arrays import Array

FITTED = 8
"""Numbers of a lens that a calibration finds: fx, fy, cx, cy and the first four of its distortion."""


class Straight(NamedTuple):
    """An undistorted point (x, y) and the four entries of d(pixel) / d(x, y) there."""

    x: float
    y: float
    u_x: float
    u_y: float
    v_x: float
    v_y: float


class Pinhole(NamedTuple):
    """Pixels (n, 2), the camera's matrix (3, 3) and the distortion (5,) that OpenCV's solvers take out themselves."""

    pixels: Array
    matrix: Array
    distortion: Array
