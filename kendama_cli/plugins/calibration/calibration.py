"""Calibrating one or several cameras from views of a ChArUco board."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.plugins.calibration.bundle import Bundle, Seen, adjust
from kendama_cli.plugins.calibration.checks import check_moments, rms
from kendama_cli.plugins.calibration.intrinsics import Intrinsics, intrinsics
from kendama_cli.plugins.calibration.one_lens import check_one_lens
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel

MIN_CORNERS = 6
MARKER_TOLERANCE = 0.1
"""Share of the side: a marker of 20 px is found a pixel too small."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board of ``columns`` x ``rows`` squares, with markers of OpenCV's dictionary 4X4_250."""

    columns: int
    rows: int
    square_m: float
    marker_m: float

    def opencv(self, *, legacy: bool = False) -> cv2.aruco.CharucoBoard:
        """Return OpenCV's board; ``legacy`` is the pattern of OpenCV before 4.6, another one where rows are even."""
        markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, markers)
        board.setLegacyPattern(legacy)
        return board

    def picture(self, pixels_per_square: int) -> NDArray[np.uint8]:
        """Draw the board to print, grey, with half a square of white about it."""
        margin = pixels_per_square // 2
        size = (self.columns * pixels_per_square + 2 * margin, self.rows * pixels_per_square + 2 * margin)
        return np.asarray(self.opencv().generateImage(size, marginSize=margin), dtype=np.uint8)

    @property
    def corners_m(self) -> Array:
        """Inner corners (n, 3) on the board: x along its rows, y down its columns, z into it, 0 at its first corner."""
        return np.asarray(self.opencv().getChessboardCorners(), dtype=np.float64)


@dataclass(frozen=True)
class BoardView:
    """Corners of the board in one image: their numbers (n,) and pixels (n, 2); and if its pattern is the legacy one."""

    name: str
    ids: NDArray[np.int64]
    pixels: Array
    legacy: bool = False
    marker_m: float = math.nan
    """Side of the markers as the corners about them tell it"""


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


def find_board(board: Board, image: NDArray[np.uint8], name: str) -> BoardView | None:
    """Return the board's corners in ``image`` (h, w, 3), by the pattern that shows more of them.

    None where fewer than six of them, or of one line, are seen.
    """
    grey, best, is_legacy = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), None, False
    for legacy in (False, True) if board.rows % 2 == 0 else (False,):
        found, ids, markers, _ = cv2.aruco.CharucoDetector(board.opencv(legacy=legacy)).detectBoard(grey)
        if ids is not None and len(ids) >= MIN_CORNERS and (best is None or len(ids) > len(best[1])):
            best, is_legacy = (found, ids, markers), legacy
    if best is None:
        return None
    found, numbers = best[0], np.asarray(best[1], dtype=np.int64).ravel()
    flat = board.corners_m[numbers, :2]
    if np.linalg.matrix_rank(flat - flat.mean(axis=0), tol=board.square_m / 2) < 2:
        return None
    pixels = np.asarray(found, dtype=np.float64).reshape(-1, 2)
    side_m = _marker_side(flat, pixels, np.asarray(best[2], dtype=np.float64))
    return BoardView(name, numbers, pixels, is_legacy, side_m)


def _marker_side(flat_m: Array, pixels: Array, markers: Array) -> float:
    """Return the mean side [m] of ``markers`` (m, 1, 4, 2) [px], laid upon the board by its corners."""
    to_board, _ = cv2.findHomography(pixels, flat_m)
    if to_board is None or not len(markers):
        return math.nan
    corners_m = cv2.perspectiveTransform(markers.reshape(-1, 1, 2), to_board).reshape(-1, 4, 2)
    return float(np.linalg.norm(corners_m - np.roll(corners_m, 1, axis=1), axis=2).mean())


def check_markers(board: Board, views: Sequence[BoardView]) -> None:
    """Raise ValueError where the markers' side, as a share of the square's, is not the board's."""
    side_m = float(np.median([view.marker_m for view in views if math.isfinite(view.marker_m)] or [board.marker_m]))
    if abs(side_m / board.marker_m - 1) > MARKER_TOLERANCE:
        raise ValueError(
            f"a marker's side is {side_m / board.square_m:.2f} of a square's in the images, and "
            f"{board.marker_m * 1e3:g} of {board.square_m * 1e3:g} mm is {board.marker_m / board.square_m:.2f}; "
            "measure both on the print"
        )


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
    middle = np.array([board.columns, board.rows, 0.0]) * board.square_m / 2
    return _pose(axes, centre_m - axes @ middle)


def _pose(rotation: Array, shift: Array) -> Array:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation, np.asarray(shift).ravel()
    return made


def _nearest_rotation(matrix: Array) -> Array:
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right)
