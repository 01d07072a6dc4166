"""A point in space from its pixels in several cameras, and the equations behind it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel

MIN_DEPTH_M = 0.05


class RayConstraints(NamedTuple):
    """Equations ``rows`` p = ``right`` (k of them) for a point p (3,), whitened but for its depth.

    Each has the noise of unit variance times the depth ``depth_row`` . p + ``depth_right``.
    """

    rows: Array
    right: Array
    depth_row: Array
    depth_right: float


def ray_constraints(camera: CameraModel, centre_px: Array, covariance_px2: Array) -> RayConstraints:
    """Return the linear constraints of one pixel (2,) with covariance (2, 2) on a point.

    With (x, y) the undistorted pixel, r1, r2, r3 the rows of R and o the optical centre:
    (r1 - x r3) . (p - o) = 0 and (r2 - y r3) . (p - o) = 0, with the pixel's noise times the depth r3 . (p - o).
    """
    u, v = centre_px
    (uu, uv), (_, vv) = covariance_px2
    at = camera.straight(float(u), float(v))
    # L^-1 J whitens the normalised point, where L is the Cholesky factor of the pixel's covariance and J its slope
    first = math.sqrt(uu)
    low = uv / first
    second = math.sqrt(vv - low * low)
    a, b = at.u_x / first, at.u_y / first
    c, d = (at.v_x - low * a) / second, (at.v_y - low * b) / second
    whiten = np.array([[a, b, -a * at.x - b * at.y], [c, d, -c * at.x - d * at.y]])
    rows = whiten @ camera.world_to_camera
    forward, origin = camera.world_to_camera[2], camera.position_in_world_m
    return RayConstraints(rows, rows @ origin, forward, -float(forward @ origin))


@dataclass(frozen=True)
class Located:
    """A point in the world and its covariance (3, 3); ``chi_square`` is the residual of the measurements over their
    noise, per degree of freedom (rows beyond three)."""

    position_m: Array
    covariance_m2: Array
    chi_square: float


def triangulate(sights: Sequence[RayConstraints]) -> Located | None:
    """Fit the point to all ``sights`` (one per pixel), by least squares weighted with the inverse depth.

    None with fewer than two sights, or where the point would lie behind a camera.
    """
    if len(sights) < 2:
        return None
    rows, right = np.vstack([sight.rows for sight in sights]), np.concatenate([sight.right for sight in sights])
    weight = np.ones(len(rows))
    for _ in range(2):
        weighted = rows * weight[:, None]
        information = weighted.T @ weighted
        try:
            covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        except np.linalg.LinAlgError:
            return None
        point = covariance @ (weighted.T @ (right * weight))
        depths = np.array([sight.depth_row @ point + sight.depth_right for sight in sights])
        if not (depths > MIN_DEPTH_M).all():
            return None
        weight = np.repeat(1.0 / depths, [len(sight.rows) for sight in sights])
    weighted = rows * weight[:, None]
    left = weighted @ point - right * weight
    covariance = np.asarray(np.linalg.inv(weighted.T @ weighted), dtype=np.float64)
    return Located(point, covariance, float(left @ left) / (len(left) - 3))
