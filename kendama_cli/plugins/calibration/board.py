"""Boards that a camera is calibrated with, and where an image shows them.

Points of every kind are numbered along the rows and lie on the board with x along its rows, y down its columns and z
into it, 0 at the corner of the first square.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array

MIN_CORNERS = 6
MARKER_TOLERANCE = 0.1
"""Share of the side: a marker of 20 px is found a pixel too small."""
CHARUCO, TAGS, STAGGERED, CIRCLES, CHESSBOARD = KINDS = ("charuco", "tags", "staggered", "circles", "chessboard")
"""In the order in which they are tried: circles may pass for a chessboard, and the markers of one for tags."""
OFF_PLANE = 0.12
"""Largest rms distance of a kind's points to where a plane would show them [squares]."""
NAMES = {"staggered": "an asymmetric grid of circles", "tags": "a grid of tags", "circles": "a grid of circles"}
DICTIONARIES = (
    *("4X4_1000", "5X5_1000", "6X6_1000", "7X7_1000", "ARUCO_ORIGINAL"),
    *("APRILTAG_36h11", "APRILTAG_25h9", "APRILTAG_16h5", "APRILTAG_36h10"),
)
"""OpenCV's dictionaries, each the largest of its family: the smaller ones are its beginning."""

Grey = NDArray[np.uint8]


@dataclass(frozen=True)
class Board:
    """A board of ``columns`` x ``rows`` squares, circles or tags, ``square_m`` from one to the next.

    ``marker_m`` is the side of a marker in a square, or of a tag.
    """

    columns: int
    rows: int
    square_m: float
    marker_m: float
    kind: str = CHARUCO
    dictionary: str = DICTIONARIES[0]

    def __str__(self) -> str:
        """Return what was seen and the lengths that it is taken to have."""
        size, square = f"{self.columns}x{self.rows}", f"{self.square_m * 1e3:g} mm"
        if self.kind == CHESSBOARD:
            return f"a chessboard of {size} squares of {square} ({self.columns - 1}x{self.rows - 1} inner corners)"
        if self.kind in (CIRCLES, STAGGERED):
            return f"{NAMES[self.kind]}, {size}, {square} from row to row"
        what = f"a ChArUco board of {size} squares" if self.kind == CHARUCO else f"{NAMES[TAGS]}, {size}"
        return f"{what} of {square}, markers of {self.marker_m * 1e3:g} mm, dictionary {self.dictionary}"

    def charuco(self, *, legacy: bool = False) -> cv2.aruco.CharucoBoard:
        """Return OpenCV's board; ``legacy`` is the pattern of OpenCV before 4.6, another one where rows are even."""
        markers = _dictionary(self.dictionary)
        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, markers)
        board.setLegacyPattern(legacy)
        return board

    def picture(self, pixels_per_square: int) -> Grey:
        """Draw the ChArUco board to print, grey, with half a square of white about it."""
        margin = pixels_per_square // 2
        size = (self.columns * pixels_per_square + 2 * margin, self.rows * pixels_per_square + 2 * margin)
        return np.asarray(self.charuco().generateImage(size, marginSize=margin), dtype=np.uint8)

    @property
    def corners_m(self) -> Array:
        """All points (n, 3) on the board: inner corners, centres of circles, or four corners of each tag."""
        if self.kind in (CHARUCO, CHESSBOARD):
            rows, columns = np.mgrid[1 : self.rows, 1 : self.columns].reshape(2, -1)
        elif self.kind == TAGS:
            rows, columns = np.mgrid[: self.rows, : self.columns].reshape(2, -1) + 0.5
            half = self.marker_m / self.square_m / 2
            columns = (columns[:, None] + [-half, half, half, -half]).ravel()
            rows = (rows[:, None] + [-half, -half, half, half]).ravel()
        else:
            rows, columns = np.mgrid[: self.rows, : self.columns].reshape(2, -1) + 0.5
            if self.kind == STAGGERED:
                columns = 2 * columns - 0.5 + (rows - 0.5) % 2
        return np.column_stack([columns, rows, np.zeros(len(rows))]) * self.square_m


@dataclass(frozen=True)
class BoardView:
    """Points of the board in one image: their numbers (n,) and pixels (n, 2); and if its pattern is the legacy one."""

    name: str
    ids: NDArray[np.int64]
    pixels: Array
    legacy: bool = False
    marker_m: float = math.nan
    """Side of the markers as the corners about them tell it"""


class BoardSearch:
    """Search for a board in images; the first image that shows one tells its kind."""

    def __init__(self, board: Board, kinds: Sequence[str] = KINDS) -> None:
        self.board = board
        self.recognised = False
        self._kinds = kinds

    def find(self, image: NDArray[np.uint8], name: str) -> BoardView | None:
        """Return the board's points in ``image`` (h, w, 3); None where it is not seen."""
        for kind in () if self.recognised else self._kinds:
            seen = [(one, found) for one in _of_kind(self.board, kind) if (found := find_board(one, image, name))]
            if seen:
                self.board, found = max(seen, key=lambda one: len(one[1].ids))
                self.recognised = True
                return found
        return find_board(self.board, image, name) if self.recognised else None


def _of_kind(board: Board, kind: str) -> Iterator[Board]:
    """Yield the boards of a kind that ``board`` may be; a chessboard's inner corners may stand for its squares."""
    if kind in (CHARUCO, TAGS):
        yield from (replace(board, kind=kind, dictionary=one) for one in DICTIONARIES)
        return
    yield replace(board, kind=kind)
    if kind == CHESSBOARD:
        yield replace(board, kind=kind, columns=board.columns + 1, rows=board.rows + 1)


def find_board(board: Board, image: NDArray[np.uint8], name: str) -> BoardView | None:
    """Return the board's points in ``image`` (h, w, 3), a ChArUco board's by the pattern that shows more of them.

    None where fewer than six of them, or of one line, are seen.
    """
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    if board.kind == CHARUCO:
        seen = [_charuco(board, grey, name, legacy=legacy) for legacy in (False, True)[: 1 + (board.rows % 2 == 0)]]
    else:
        seen = [{CHESSBOARD: _chessboard, TAGS: _tags}.get(board.kind, _circles)(board, grey, name)]
    found = max((one for one in seen if one is not None), key=lambda one: len(one.ids), default=None)
    if found is None or len(found.ids) < MIN_CORNERS:
        return None
    flat = board.corners_m[found.ids, :2]
    return None if np.linalg.matrix_rank(flat - flat.mean(axis=0), tol=board.square_m / 2) < 2 else found


def _charuco(board: Board, grey: Grey, name: str, *, legacy: bool) -> BoardView | None:
    found, ids, markers, _ = cv2.aruco.CharucoDetector(board.charuco(legacy=legacy)).detectBoard(grey)
    if ids is None or len(ids) < MIN_CORNERS:
        return None
    numbers, pixels = np.asarray(ids, dtype=np.int64).ravel(), np.asarray(found, dtype=np.float64).reshape(-1, 2)
    side_m = _marker_side(board.corners_m[numbers, :2], pixels, np.asarray(markers, dtype=np.float64))
    return BoardView(name, numbers, pixels, legacy, side_m)


def _marker_side(flat_m: Array, pixels: Array, markers: Array) -> float:
    """Return the mean side [m] of ``markers`` (m, 1, 4, 2) [px], laid upon the board by its corners."""
    to_board, _ = cv2.findHomography(pixels, flat_m)
    if to_board is None or not len(markers):
        return math.nan
    corners_m = cv2.perspectiveTransform(markers.reshape(-1, 1, 2), to_board).reshape(-1, 4, 2)
    return float(np.linalg.norm(corners_m - np.roll(corners_m, 1, axis=1), axis=2).mean())


def _chessboard(board: Board, grey: Grey, name: str) -> BoardView | None:
    inner = (board.columns - 1, board.rows - 1)
    flags = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE
    seen, found = cv2.findChessboardCornersSB(grey, inner, flags=flags)
    if not seen:
        return None
    pixels = np.asarray(found, dtype=np.float64).reshape(-1, 2)
    return BoardView(name, np.arange(len(pixels)), pixels if _first_is_black(board, grey, pixels) else pixels[::-1])


def _first_is_black(board: Board, grey: Grey, pixels: Array) -> bool:
    """Return True where the points begin at the board's black corner square.

    Where both ways round show the same squares: where its rows run to the right in the image.
    """
    if (board.columns + board.rows) % 2 == 0:
        return bool(pixels[-1, 0] > pixels[0, 0])
    to_image, _ = cv2.findHomography(board.corners_m[:, :2], pixels)
    squares = np.array([[[0.5, 0.5]], [[1.5, 0.5]]]) * board.square_m
    at = np.clip(np.rint(cv2.perspectiveTransform(squares, to_image)[:, 0]), 0, np.array(grey.shape[::-1]) - 1)
    first, second = (int(grey[int(y), int(x)]) for x, y in at)
    return first < second


def _circles(board: Board, grey: Grey, name: str) -> BoardView | None:
    symmetric = cv2.CALIB_CB_SYMMETRIC_GRID if board.kind == CIRCLES else cv2.CALIB_CB_ASYMMETRIC_GRID
    seen, found = cv2.findCirclesGrid(grey, (board.columns, board.rows), flags=symmetric | cv2.CALIB_CB_CLUSTERING)
    if not seen:
        return None
    pixels = np.asarray(found, dtype=np.float64).reshape(-1, 2)
    if _off_plane(board, np.arange(len(pixels)), pixels) > OFF_PLANE:
        return None
    turned = board.kind == CIRCLES and pixels[-1, 0] < pixels[0, 0]
    return BoardView(name, np.arange(len(pixels)), pixels[::-1] if turned else pixels)


def _tags(board: Board, grey: Grey, name: str) -> BoardView | None:
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    found, ids, _ = cv2.aruco.ArucoDetector(_dictionary(board.dictionary), settings).detectMarkers(grey)
    seen = {} if ids is None else dict(zip(np.asarray(ids).ravel().tolist(), found, strict=True))
    tags = [number for number in sorted(seen) if number < board.columns * board.rows]
    if not tags:
        return None
    pixels = np.concatenate([np.asarray(seen[number], dtype=np.float64).reshape(4, 2) for number in tags])
    downwards = np.array(tags)
    upwards = downwards + board.columns * (board.rows - 1 - 2 * (downwards // board.columns))  # as Kalibr numbers them
    numbered = [(4 * order[:, None] + np.arange(4)).ravel() for order in (downwards, upwards)]
    off = [_off_plane(board, ids, pixels) for ids in numbered]
    return BoardView(name, numbered[int(np.argmin(off))], pixels) if min(off) < OFF_PLANE else None


def _off_plane(board: Board, ids: NDArray[np.int64], pixels: Array) -> float:
    """Return the rms distance of points, laid upon the board as well as they fit, to where they belong [squares]."""
    flat_m = board.corners_m[ids, :2]
    to_board: Array | None = cv2.findHomography(pixels, flat_m)[0]  # type: ignore[assignment]
    if to_board is None:
        return math.inf
    off_m = cv2.perspectiveTransform(pixels[:, None], to_board)[:, 0] - flat_m
    return float(np.sqrt((off_m**2).sum(axis=1).mean())) / board.square_m


def _dictionary(name: str) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))


def check_markers(board: Board, views: Sequence[BoardView]) -> None:
    """Raise ValueError where the markers' side, as a share of the square's, is not the board's."""
    side_m = float(np.median([view.marker_m for view in views if math.isfinite(view.marker_m)] or [board.marker_m]))
    if abs(side_m / board.marker_m - 1) > MARKER_TOLERANCE:
        raise ValueError(
            f"a marker's side is {side_m / board.square_m:.2f} of a square's in the images, and "
            f"{board.marker_m * 1e3:g} of {board.square_m * 1e3:g} mm is {board.marker_m / board.square_m:.2f}; "
            "measure both on the print"
        )
