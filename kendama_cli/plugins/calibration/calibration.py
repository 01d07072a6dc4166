"""Calibrating one or several cameras from views of a board, together by bundle adjustment (Triggs et al., 2000).

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

from kendama_cli.plugins.calibration.board import MIN_CORNERS, Board, BoardView, check_markers
from kendama_cli.plugins.calibration.intrinsics import Intrinsics, check_moments, intrinsics, rms
from kendama_cli.plugins.calibration.one_lens import check_one_lens
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
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


@dataclass(frozen=True)
class CalibratedCamera:
    """A camera's model, the standard deviations of (fx, fy, cx, cy) [px], and what each view leaves over.

    ``errors_px`` (v,) is the rms distance of seen and projected corners per view, ``residuals_px`` (n_i, 2) each of
    them: seen less projected.
    """

    model: CameraModel
    sigma_px: Array
    views: tuple[BoardView, ...]
    errors_px: Array
    residuals_px: tuple[Array, ...]

    @property
    def rms_px(self) -> float:
        """Over all corners of all views."""
        return float(np.sqrt((np.concatenate(self.residuals_px) ** 2).sum(axis=1).mean()))


def calibrate(
    board: Board,
    views: Mapping[str, Sequence[BoardView]],
    sizes: Mapping[str, tuple[int, int]],
    centre_m: Array,
) -> list[CalibratedCamera]:
    """Calibrate all cameras: each one's intrinsics by itself, its pose to the first, then all adjusted together.

    ``views`` and ``sizes`` (width, height) are by camera; views of one name were taken at one moment. The world: in the
    first view of the first camera the board's middle lies at ``centre_m``, its rows along x, z up out of its print.
    Raises ValueError where the views do not suffice.
    """
    check_markers(board, [view for seen in views.values() for view in seen])
    fits = {
        name: intrinsics(name, seen, [board.corners_m[view.ids] for view in seen], sizes[name])
        for name, seen in views.items()
    }
    for name, seen in views.items():
        check_one_lens(name, seen, [board.corners_m[view.ids] for view in seen], sizes[name])
    names = list(views)
    cameras = np.array([np.eye(4), *(_to_other(board, (names[0], name), views, fits) for name in names[1:])])
    bundle, errors = _together(board, views, fits, cameras)
    if len(names) > 1:
        check_moments(views, {name: fit.errors_px for name, fit in fits.items()}, errors, sizes[names[0]][0])
    world = bundle.boards[0] @ np.linalg.inv(_board_to_world(board, centre_m))
    made = []
    for k, name in enumerate(names):
        pose = bundle.cameras[k] @ world
        rotation = _nearest_rotation(pose[:3, :3])
        lens = bundle.lenses[k]
        model = CameraModel(
            name=name,
            width_px=sizes[name][0],
            height_px=sizes[name][1],
            focal_px=lens[:2],
            center_px=lens[2:4],
            distortion=np.append(lens[4:], 0.0),
            world_to_camera=rotation,
            position_in_world_m=-rotation.T @ pose[:3, 3],
        )
        left = errors[name]
        rms_px = np.array([rms(one) for one in left])
        made.append(CalibratedCamera(model, bundle.lens_sigmas[k, :4], tuple(views[name]), rms_px, tuple(left)))
    return made


def _together(
    board: Board,
    views: Mapping[str, Sequence[BoardView]],
    fits: Mapping[str, Intrinsics],
    cameras: Array,
) -> tuple[Bundle, dict[str, list[Array]]]:
    """Adjust all cameras together, starting from each alone; return them and the residuals of every view."""
    seen, boards, owners = [], dict[int, Array](), []
    moments: dict[str, int] = {}
    for k, (name, fit) in enumerate(fits.items()):
        for view, rotation, shift in zip(views[name], fit.rotations, fit.shifts, strict=True):
            moment = moments.setdefault(view.name, len(moments))
            boards.setdefault(moment, np.linalg.inv(cameras[k]) @ _pose(rotation, shift))
            seen.append(Seen(k, moment, board.corners_m[view.ids], view.pixels))
            owners.append(name)
    bundle = adjust(seen, np.array([fit.numbers for fit in fits.values()]), cameras, boards)
    errors: dict[str, list[Array]] = {name: [] for name in fits}
    for name, left in zip(owners, bundle.residuals_px, strict=True):
        errors[name].append(left)
    return bundle, errors


def _to_other(
    board: Board,
    pair: tuple[str, str],
    views: Mapping[str, Sequence[BoardView]],
    fits: Mapping[str, Intrinsics],
) -> Array:
    """Return the map (4, 4) from the first camera's axes to the other's, by corners that both see at one time."""
    a, b = pair
    one, two = fits[a].lens, fits[b].lens
    other = {view.name: view for view in views[b]}
    points, seen_a, seen_b = [], [], []
    for view in views[a]:
        if view.name not in other:
            continue
        ids, at_a, at_b = np.intersect1d(view.ids, other[view.name].ids, return_indices=True)
        if len(ids) >= MIN_CORNERS:
            points.append(board.corners_m[ids].astype(np.float32))
            seen_a.append(view.pixels[at_a].astype(np.float32)[:, None])
            seen_b.append(other[view.name].pixels[at_b].astype(np.float32)[:, None])
    if not points:
        raise ValueError(
            f"cameras '{a}' and '{b}' see the board together in no view; views of one moment must have one name, or "
            "one place in their videos"
        )
    result = cv2.stereoCalibrate(
        points, seen_a, seen_b, one.matrix, one.distortion, two.matrix, two.distortion, (1, 1),
        flags=cv2.CALIB_FIX_INTRINSIC,
    )  # fmt: skip
    return _pose(np.asarray(result[5]), np.asarray(result[6]))


def _board_to_world(board: Board, centre_m: Array) -> Array:
    """Return the map (4, 4) of the board's axes into the world's, where it lies with its print upwards."""
    axes = np.diag([1.0, -1.0, -1.0])
    return _pose(axes, centre_m - axes @ board.corners_m.mean(axis=0))


def _pose(rotation: Array, shift: Array) -> Array:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation, np.asarray(shift).ravel()
    return made


def _nearest_rotation(matrix: Array) -> Array:
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right)
