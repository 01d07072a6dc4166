"""Boards of each kind are recognised and calibrate to the pinhole that saw them; OpenCV's own photographs too."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from kendama_cli.plugins.calibration.board import CHESSBOARD, KINDS, Board, BoardSearch, find_board
from kendama_cli.plugins.calibration.calibration import calibrate

PER_SQUARE = 60
SAMPLES = Path(os.environ.get("KENDAMA_OPENCV_SAMPLES", "samples-not-fetched"))


def chessboard(columns: int, rows: int) -> Any:
    black = (np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0).repeat(PER_SQUARE, 0).repeat(PER_SQUARE, 1)
    return np.pad(np.where(black, 0, 255).astype(np.uint8), PER_SQUARE // 2, constant_values=255)


def circles(centres: Any, width: int, height: int) -> Any:
    picture = np.full((height, width), 255, dtype=np.uint8)
    for x, y in centres:
        cv2.circle(picture, (round(x), round(y)), PER_SQUARE // 4, 0, -1, cv2.LINE_AA)
    return picture


def markers(name: int) -> Any:
    return cv2.aruco.getPredefinedDictionary(name)


def drawn() -> dict[str, tuple[Any, Board, int]]:
    """Return pictures by OpenCV or by hand, the board that a user describes, and its number of points."""
    square = PER_SQUARE
    grid = [((c + 0.5) * square, (r + 0.5) * square) for r in range(6) for c in range(8)]
    staggered = [((2 * c + r % 2 + 0.5) * square / 2, (r + 0.5) * square / 2) for r in range(11) for c in range(4)]
    tags = cv2.aruco.GridBoard((6, 4), 0.022, 0.008, markers(cv2.aruco.DICT_APRILTAG_36h11))
    numbers = np.arange(24).reshape(4, 6)[::-1].ravel()
    upwards = cv2.aruco.GridBoard((6, 4), 0.022, 0.008, markers(cv2.aruco.DICT_APRILTAG_36h11), numbers)
    charuco = cv2.aruco.CharucoBoard((7, 5), 0.03, 0.022, markers(cv2.aruco.DICT_5X5_100))
    return {
        "charuco": (charuco.generateImage((480, 360), marginSize=30), Board(7, 5, 0.03, 0.022), 24),
        "chessboard": (chessboard(10, 7), Board(10, 7, 0.025, 0.02), 54),
        "inner corners": (chessboard(10, 7), Board(9, 6, 0.025, 0.02), 54),
        "circles": (circles(grid, 480, 360), Board(8, 6, 0.03, 0.02), 48),
        "staggered": (circles(staggered, 270, 360), Board(4, 11, 0.015, 0.01), 44),
        "tags as Kalibr numbers them": (
            upwards.generateImage((6 * 60, 4 * 60), marginSize=8),
            Board(6, 4, 0.03, 0.022),
            96,
        ),
        "tags": (tags.generateImage((6 * 60, 4 * 60), marginSize=8), Board(6, 4, 0.03, 0.022), 96),
    }


@pytest.mark.parametrize("shown", drawn())
def test_a_board_of_each_kind_is_recognised_and_calibrates_to_the_pinhole_that_saw_it(shown: str) -> None:
    picture, board, points = drawn()[shown]
    height, width = picture.shape
    picture = cv2.copyMakeBorder(picture, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255)
    scale = 0.24 / width
    to_board_m = np.array([[scale, 0, -(width / 2 + 40) * scale], [0, scale, -(height / 2 + 40) * scale], [0, 0, 1]])
    pinhole, rng = np.array([[900.0, 0, 400], [0, 900, 300], [0, 0, 1]]), np.random.default_rng(10000)
    # among all kinds a chessboard takes seconds: once
    search, views = BoardSearch(board, (CHESSBOARD,) if shown == "inner corners" else KINDS), []
    for number in range(10):
        turned = cv2.Rodrigues(np.append(rng.uniform(-0.5, 0.5, 2), rng.uniform(-0.3, 0.3)))[0]
        shift = rng.uniform([-0.03, -0.02, 0.45], [0.03, 0.02, 0.6])
        way = pinhole @ np.column_stack([turned[:, :2], shift]) @ to_board_m
        image = cv2.warpPerspective(picture, way, (800, 600), borderValue=120, flags=cv2.INTER_AREA)
        found = search.find(cv2.cvtColor(cv2.GaussianBlur(image, (3, 3), 0), cv2.COLOR_GRAY2BGR), f"{number}")
        views += [] if found is None else [found]
    assert search.board.kind == {"inner corners": "chessboard"}.get(shown, shown.split(maxsplit=1)[0])
    assert len(views) >= 6
    assert len(search.board.corners_m) == points == max(len(view.ids) for view in views)
    made = calibrate(search.board, {"one": views}, {"one": (800, 600)}, np.zeros(3))[0]
    off_px = np.array([*made.model.focal_px, *made.model.center_px]) - [900, 900, 400, 300]
    assert (np.abs(off_px) < 6).all()
    assert made.rms_px < 0.5


def test_two_ways_round_a_chessboard_are_told_apart_by_its_colours() -> None:
    picture = cv2.cvtColor(cv2.resize(chessboard(10, 7), (400, 290)), cv2.COLOR_GRAY2BGR)
    upright, turned = (
        find_board(Board(10, 7, 0.025, 0.02, CHESSBOARD), image, "") for image in (picture, picture[::-1, ::-1])
    )
    assert upright is not None
    assert turned is not None
    np.testing.assert_allclose(turned.pixels, [399, 289] - upright.pixels, atol=0.3)


def test_no_board_is_none_and_an_image_of_noise_too() -> None:
    for image in (np.full((300, 400, 3), 120), np.random.default_rng(0).integers(0, 255, (300, 400, 3))):
        search = BoardSearch(Board(7, 5, 0.03, 0.022), KINDS)
        assert search.find(image.astype(np.uint8), "") is None
        assert not search.recognised


@pytest.mark.slow
@pytest.mark.parametrize(
    ("camera", "focal_px", "centre_px"), [("left", 518.05, (313.88, 249.39)), ("right", 518.05, (327.59, 261.50))]
)
def test_opencvs_own_photographs_calibrate_as_its_own_sample_program_does(
    camera: str, focal_px: float, centre_px: tuple[float, float]
) -> None:
    """The values are of OpenCV's stereo_calib.cpp on the same images, one focal length and more distortion."""
    images = sorted(SAMPLES.glob(f"{camera}??.jpg"))
    if not images:
        pytest.skip(f"no {SAMPLES}/left*.jpg: set KENDAMA_OPENCV_SAMPLES to OpenCV's samples/data")
    search = BoardSearch(Board(9, 6, 0.025, 0.02))
    found = [search.find(cv2.imread(str(path)), path.stem) for path in images]
    views = [view for view in found if view is not None]
    assert len(views) >= 13
    made = calibrate(search.board, {camera: views}, {camera: (640, 480)}, np.zeros(3))[0]
    assert made.rms_px < 0.25
    np.testing.assert_allclose(made.model.focal_px, focal_px, rtol=0.005)
    np.testing.assert_allclose(made.model.center_px, centre_px, atol=6)
