"""Several cameras from views of one board together: bundle adjustment (Triggs et al., "Bundle Adjustment", 2000).

One camera alone trades the board's distance for focal length, and another camera's pose on top of that is wrong by
millimetres. Together, what each sees of one board at one moment must agree: all intrinsics, the other cameras' poses to
the first and the board's pose at every moment minimise the distance of seen and projected corners.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.radial_lens import FITTED as LENS
from kendama_cli.vision.cameras.radial_lens import RadialLens

POSE = 6
"""A rotation vector and a shift."""

MOST_STEPS = 60
"""Ten do where the views are of one board; of views that contradict each other the end is no matter."""


@dataclass(frozen=True)
class Seen:
    """Corners of the board by one camera at one moment (numbers): on the board (n, 3), in the image (n, 2)."""

    camera: int
    moment: int
    points_m: Array
    pixels: Array


@dataclass(frozen=True)
class Bundle:
    """Parameters that explain the corners: C cameras, M views."""

    lenses: Array
    """(C, 8): fx, fy, cx, cy and four of the distortion; a radial lens's k3 is left at 0 (``calibration.FLAGS``)"""
    lens_sigmas: Array
    """(C, 8): standard deviations"""
    cameras: Array
    """(C, 4, 4): from the first camera's axes to each one's"""
    boards: dict[int, Array]
    """(4, 4) by moment: from the board's axes to the first camera's"""
    residuals_px: tuple[Array, ...]
    """(n_i, 2) of each sight: seen less projected"""


def adjust(seen: Sequence[Seen], lenses: Array, cameras: Array, boards: Mapping[int, Array]) -> Bundle:
    """Fit the bundle near ``lenses`` (C, 8), ``cameras`` (C, 4, 4), ``boards`` (4, 4) to the first camera, by view."""
    moments = {moment: i for i, moment in enumerate(sorted(boards))}
    others, first_board = len(lenses) - 1, len(lenses) * LENS + (len(lenses) - 1) * POSE
    start = np.concatenate(
        [lenses.ravel(), *(_vector(one) for one in cameras[1:]), *(_vector(boards[one]) for one in moments)]
    )
    rows = np.cumsum([0, *(2 * len(one.pixels) for one in seen)])

    def places(one: Seen) -> tuple[slice, slice | None, slice]:
        board = first_board + POSE * moments[one.moment]
        pose = None if one.camera == 0 else slice(len(lenses) * LENS + POSE * (one.camera - 1), None)
        lens = slice(LENS * one.camera, LENS * (one.camera + 1))
        return lens, None if pose is None else slice(pose.start, pose.start + POSE), slice(board, board + POSE)

    def residuals(values: Array) -> Array:
        return np.concatenate([_projected(one, values, places(one))[0].ravel() for one in seen])

    def slopes(values: Array) -> Array:
        whole = np.zeros((rows[-1], len(values)))
        for i, one in enumerate(seen):
            where = places(one)
            for place, slope in zip(where, _projected(one, values, where)[1], strict=True):
                if place is not None and slope is not None:
                    whole[rows[i] : rows[i + 1], place] = slope
        return whole

    best = least_squares(residuals, start, jac=slopes, method="lm", x_scale="jac", max_nfev=MOST_STEPS)
    variance = 2 * best.cost / max(len(best.fun) - len(start), 1)
    slope = np.asarray(best.jac, dtype=np.float64)
    sigma = np.sqrt(variance * np.linalg.pinv(slope.T @ slope).diagonal())
    poses = best.x[len(lenses) * LENS : first_board].reshape(others, POSE)
    return Bundle(
        lenses=best.x[: len(lenses) * LENS].reshape(-1, LENS),
        lens_sigmas=sigma[: len(lenses) * LENS].reshape(-1, LENS),
        cameras=np.array([np.eye(4), *(_matrix(one) for one in poses)]),
        boards={one: _matrix(best.x[first_board + POSE * i :][:POSE]) for one, i in moments.items()},
        residuals_px=tuple(-best.fun[rows[i] : rows[i + 1]].reshape(-1, 2) for i in range(len(seen))),
    )


def _projected(
    one: Seen, values: Array, places: tuple[slice, slice | None, slice]
) -> tuple[Array, tuple[Array, Array | None, Array]]:
    """Return projected less seen pixels (n, 2), and their slopes (2 n, k) by lens, camera's and board's pose."""
    lens, pose, board = places
    turn, shift, chain = values[board][:3], values[board][3:], np.eye(POSE)
    if pose is not None:
        made = [np.asarray(one, dtype=np.float64) for one in cv2.composeRT(turn, shift, *_halves(values[pose]))]
        turn, shift = made[:2]
        # its slopes: the turn's by turn, shift, turn and shift of the two; then the shift's
        chain = np.vstack([np.hstack(made[2:6]), np.hstack(made[6:10])])
    pixels, slope = RadialLens(*values[lens].tolist()).posed(one.points_m, turn, shift)
    moved = slope[:, :POSE] @ chain
    by_pose = None if pose is None else moved[:, POSE:]
    return pixels - one.pixels, (slope[:, POSE:], by_pose, moved[:, :POSE])


def _halves(pose: Array) -> tuple[Array, Array]:
    return pose[:3], pose[3:]


def _vector(pose: Array) -> Array:
    return np.concatenate([np.asarray(cv2.Rodrigues(pose[:3, :3])[0], dtype=np.float64).ravel(), pose[:3, 3]])


def _matrix(vector: Array) -> Array:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = cv2.Rodrigues(vector[:3])[0], vector[3:]
    return made
