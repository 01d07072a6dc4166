"""The pose of a square marker from its four corners: both solutions of the planar ambiguity, each with covariance.

Four coplanar points seen from afar fit nearly as well with the plane tilted the other way; which is right is told by
time (``pose_track.py``), never by one image. (T. Collins, A. Bartoli, "Infinitesimal plane-based pose estimation",
IJCV 109, 2014: IPPE; both are refined to the least error of reprojection.)
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from kendama_cli.plugins.marker.detection import SeenMarker
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel

CORNERS = np.array([(-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)], dtype=np.float64) / 2
"""Of a marker of side 1, in the order of ``SeenMarker``: x right, y up, z out of the print, as IPPE_SQUARE wants it."""


@dataclass(frozen=True)
class PoseCandidate:
    """The marker in the camera's frame: ``place_m`` (3,), ``rotation`` (3, 3) of its axes.

    ``covariance`` (6, 6) is of place [m] and of a small turn in the camera's frame [rad] for corners known to 1 px;
    ``error_px`` the rms distance of the reprojected corners.
    """

    place_m: Array
    rotation: Array
    covariance: Array
    error_px: float


def marker_poses(seen: SeenMarker, side_m: float, camera: CameraModel) -> list[PoseCandidate]:
    """Return one or two candidates, best first; none if the corners are no square before the camera."""
    points, lens, corners_px = side_m * CORNERS, camera.optics, seen.corners_px
    try:
        count, turns, places, _ = cv2.solvePnPGeneric(
            points, corners_px, lens.matrix, lens.distortion, flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
    except cv2.error:
        return []
    found = []
    for turn, place in zip(turns[:count], places[:count], strict=True):
        turned, placed = cv2.solvePnPRefineLM(
            points, corners_px, lens.matrix, lens.distortion, np.array(turn), np.array(place)
        )
        made, _ = lens.posed(points, turned, placed)
        if not (np.isfinite(made).all() and float(placed[2, 0]) > 0):
            continue
        rotation = np.asarray(cv2.Rodrigues(turned)[0])
        spread = np.sum((made.reshape(4, 2) - corners_px) ** 2)
        found.append(
            PoseCandidate(
                np.asarray(placed, dtype=np.float64).ravel(),
                np.asarray(rotation, dtype=np.float64),
                _covariance(points @ rotation.T, np.asarray(placed, dtype=np.float64).ravel(), camera),
                max(float(np.sqrt(spread / 4)), seen.sigma_px),
            )
        )
    return sorted(found, key=lambda one: one.error_px)


def _covariance(turned_m: Array, place_m: Array, camera: CameraModel) -> Array:
    """Return (J^T J)^-1 (6, 6) for corners with 1 px: of position and of a small rotation w in the camera's frame.

    A corner at p = place + v moves by dp = dplace + w x v.
    """
    rows = []
    for v in turned_m:
        cross = np.array([[0.0, v[2], -v[1]], [-v[2], 0.0, v[0]], [v[1], -v[0], 0.0]])
        rows.append(_pixel_slopes(camera, place_m + v) @ np.hstack((np.eye(3), cross)))
    jacobian = np.vstack(rows)
    return np.asarray(np.linalg.pinv(jacobian.T @ jacobian, rcond=1e-12))


def _pixel_slopes(camera: CameraModel, position_m: Array) -> Array:
    """Return d(pixel) / d(position) (2, 3) of the pinhole, without the distortion's small curvature."""
    (x, y, z), lens = position_m, camera.optics
    return np.array([(lens.fx / z, 0.0, -lens.fx * x / z**2), (0.0, lens.fy / z, -lens.fy * y / z**2)])
