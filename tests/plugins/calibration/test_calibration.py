"""Calibration recovers the cameras that rendered its views, and says what its views lack."""

import cv2
import numpy as np
import pytest

from kendama_cli.plugins.calibration.board import Board, find_board
from kendama_cli.plugins.calibration.calibration import calibrate
from tests.plugins.calibration.board_views import BOARD, camera, pair, poses, view

AT = np.array([0.2, -0.1, 0.3])


def seen_by(model, held, first=0):
    found = [find_board(BOARD, view(model, pose, seed=i + first), f"{i:03d}") for i, pose in enumerate(held, first)]
    return [one for one in found if one is not None]


@pytest.fixture(scope="module")
def made():
    held = poses(16, seed=10000)
    views = {model.name: seen_by(model, held) for model in pair()}
    return calibrate(BOARD, views, dict.fromkeys(views, (640, 480)), AT)


def test_intrinsics_are_recovered_within_their_own_standard_deviations(made):
    for found, true in zip(made, pair(), strict=True):
        error = np.concatenate([found.model.focal_px - true.focal_px, found.model.center_px - true.center_px])
        assert (np.abs(error) < 4 * found.sigma_px).all()
        assert (found.sigma_px < 2.0).all()  # 0.3 % of the focal length
        assert found.rms_px < 0.15


def test_points_of_the_world_are_mapped_like_the_true_camera_maps_them(made):
    """Where the board was held; pose and intrinsics make up for each other's errors there."""
    grid = np.array(np.meshgrid(np.linspace(-0.18, 0.18, 7), np.linspace(-0.12, 0.12, 5), [0.0, 0.08])).reshape(3, -1).T
    for found, true in zip(made, pair(), strict=True):
        off_px = np.linalg.norm(found.model.project(grid + AT) - true.project(grid), axis=1)
        assert np.sqrt((off_px**2).mean()) < 0.5
        assert off_px.max() < 1.5


def test_poses_stand_in_the_boards_world(made):
    for found, true in zip(made, pair(), strict=True):
        assert np.abs(found.model.position_in_world_m - AT - true.position_in_world_m).max() < 0.0015
        turned = found.model.world_to_camera @ true.world_to_camera.T
        assert np.degrees(np.arccos((np.trace(turned) - 1) / 2)) < 0.3
    baseline = made[1].model.position_in_world_m - made[0].model.position_in_world_m
    expected = pair()[1].position_in_world_m - pair()[0].position_in_world_m
    assert np.linalg.norm(baseline - expected) < 0.0015


def test_each_view_has_its_error_and_a_wrong_corner_shows_in_it():
    model = pair()[0]
    views = seen_by(model, poses(8, seed=10001))
    before = calibrate(BOARD, {"left": views}, {"left": (640, 480)}, AT)[0]
    changed = int(np.argmin(before.errors_px))
    views[changed].pixels[3] += 5.0
    after = calibrate(BOARD, {"left": views}, {"left": (640, 480)}, AT)[0]
    assert len(after.errors_px) == len(views)
    assert int(np.argmax(after.errors_px)) == changed
    assert after.errors_px[changed] > 3 * before.errors_px[changed]


def test_too_few_views_are_refused():
    views = seen_by(pair()[0], poses(3, seed=10002))
    with pytest.raises(ValueError, match="camera 'left': the board is seen in 3 images, at least 4 are needed"):
        calibrate(BOARD, {"left": views}, {"left": (640, 480)}, AT)


def test_views_that_are_all_parallel_are_refused():
    held = [(np.eye(3), np.array([x, y, 0.0])) for x in (-0.04, 0.04) for y in (-0.03, 0.0, 0.03)]
    above = camera("left", (0.0, -0.01, 0.45))
    with pytest.raises(
        ValueError, match=r"differs by \d+\.\d degrees between its views, above 15 are needed to tell the focal"
    ):
        calibrate(BOARD, {"left": seen_by(above, held)}, {"left": (640, 480)}, AT)


def test_cameras_without_a_common_view_are_refused():
    left, right = pair()
    views = {"left": seen_by(left, poses(5, seed=3)), "right": seen_by(right, poses(5, seed=4), first=50)}
    with pytest.raises(ValueError, match="cameras 'left' and 'right' see the board together in no view"):
        calibrate(BOARD, views, dict.fromkeys(views, (640, 480)), AT)


def test_no_board_and_a_board_of_another_kind_are_not_seen():
    assert find_board(BOARD, np.full((480, 640, 3), 120, dtype=np.uint8), "empty") is None
    shown = view(pair()[0], poses(1, seed=0)[0])
    assert find_board(BOARD, shown, "same") is not None
    assert find_board(Board(7, 5, 0.060, 0.044), shown, "the same, twice as large") is not None  # size cannot be seen


@pytest.mark.parametrize(("columns", "rows", "legacy"), [(5, 8, False), (6, 8, True), (8, 5, True)])
def test_boards_of_either_pattern_are_seen_and_calibrate_to_the_pinhole_that_saw_them(columns, rows, legacy):
    """The board is OpenCV's own, with another of its dictionaries; the camera is a homography of this test."""
    drawn = cv2.aruco.CharucoBoard(
        (columns, rows), 0.03, 0.022, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    )
    drawn.setLegacyPattern(legacy)
    picture = cv2.cvtColor(drawn.generateImage((columns * 60, rows * 60)), cv2.COLOR_GRAY2BGR)
    to_board_m = np.array([[5e-4, 0, -columns * 0.015], [0, 5e-4, -rows * 0.015], [0, 0, 1]])
    pinhole, rng = np.array([[700.0, 0, 320], [0, 700, 240], [0, 0, 1]]), np.random.default_rng(10000)
    board, views = Board(columns, rows, 0.03, 0.022), []
    for number in range(7):
        turned = cv2.Rodrigues(np.append(rng.uniform(-0.6, 0.6, 2), rng.uniform(-0.3, 0.3)))[0]
        shift = rng.uniform([-0.04, -0.03, 0.42], [0.04, 0.03, 0.6])
        seen_by_it = pinhole @ np.column_stack([turned[:, :2], shift]) @ to_board_m
        image = cv2.warpPerspective(picture, seen_by_it, (640, 480), borderValue=(120, 120, 120), flags=cv2.INTER_AREA)
        views.append(find_board(board, cv2.GaussianBlur(image, (3, 3), 0), f"{number}"))
    assert all(one is not None and one.legacy == (legacy and rows % 2 == 0) for one in views)
    made = calibrate(board, {"one": views}, {"one": (640, 480)}, AT)[0]
    off_px = np.array([*made.model.focal_px, *made.model.center_px]) - [700, 700, 320, 240]
    assert (np.abs(off_px) < 4 * made.sigma_px).all()
    assert (made.sigma_px < 5.0).all()
