"""Calibrating one or several cameras from views of a board."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from kendama_cli.plugins.calibration.board import MIN_CORNERS, Board, BoardView, check_markers
from kendama_cli.plugins.calibration.bundle import Bundle, Seen, adjust
from kendama_cli.plugins.calibration.intrinsics import Intrinsics, check_moments, intrinsics, rms
from kendama_cli.plugins.calibration.one_lens import check_one_lens
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel


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
