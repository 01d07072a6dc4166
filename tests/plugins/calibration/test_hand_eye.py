"""Cameras are placed in a robot's world as well as is told; poses that cannot tell it are refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.plugins.calibration.hand_eye import EndEffectorPose, PlacedCameras, place_cameras, place_on_link
from tests.plugins.calibration.board_on_hand import IN_HAND, Told, calibrated, cameras, told
from tests.plugins.calibration.board_views import BOARD


def placed(given: Told) -> PlacedCameras:
    return place_cameras(BOARD, calibrated(cameras()), given.views, given.hands)


def off(made: PlacedCameras) -> tuple[np.ndarray, np.ndarray]:
    """Mean error of the cameras' places, and of their rotation, about the robot's axes."""
    places = [
        one.position_in_world_m - true.position_in_world_m for one, true in zip(made.cameras, cameras(), strict=True)
    ]
    turns = [one.world_to_camera.T @ true.world_to_camera for one, true in zip(made.cameras, cameras(), strict=True)]
    return np.mean(places, axis=0), Rotation.from_matrix(turns).mean().as_rotvec()


def test_exact_poses_place_the_cameras_to_the_corners_noise() -> None:
    made = placed(told(12, 10000))
    place, turn = off(made)
    assert np.abs(place).max() < 0.0005
    assert np.abs(turn).max() < 0.001
    assert made.rms_px == pytest.approx(0.1 * np.sqrt(2), rel=0.1)
    assert made.views == 24
    corner = np.array([-BOARD.columns / 2, BOARD.rows / 2, 0]) * BOARD.square_m
    assert made.board_in_hand_m == pytest.approx(IN_HAND[1] + IN_HAND[0] @ corner, abs=0.0005)


def test_cameras_on_a_link_before_a_board_that_stands_are_placed_in_the_link() -> None:
    """The same images are of a standing board: where the hand's frame takes the world's place, it is the link's."""
    given, turn = told(12, 10000), Rotation.from_euler("xyz", [0.2, 1.0, -0.4]).as_matrix()
    links = {name: hand.inverse() for name, hand in given.hands.items()}  # the link in a world that holds the board
    elsewhere = {
        name: EndEffectorPose(turn @ one.place_m + [0.1, 0.2, 0.3], turn @ one.rotation) for name, one in links.items()
    }
    made = place_on_link("wrist", BOARD, calibrated(cameras()), given.views, elsewhere)
    place, rotation = off(made)
    assert np.abs(place).max() < 0.0005
    assert np.abs(rotation).max() < 0.001
    assert {one.link for one in made.cameras} == {"wrist"}
    corner = np.array([-BOARD.columns / 2, BOARD.rows / 2, 0]) * BOARD.square_m
    board_m = turn @ (IN_HAND[1] + IN_HAND[0] @ corner) + [0.1, 0.2, 0.3]
    assert made.board_in_hand_m == pytest.approx(board_m, abs=0.0005)


def test_what_is_told_of_the_error_holds_for_a_robot_that_is_off() -> None:
    """0.5 mm and 0.1 deg a pose: the told standard deviations are those of the errors over 16 calibrations."""
    errors, sigmas = [], []
    for seed in range(10000, 10016):
        made = placed(told(12, seed, robot_m=5e-4, robot_rad=1.7e-3))
        errors.append(np.concatenate(off(made)))
        sigmas.append(np.concatenate([made.sigma_m, made.sigma_rad]))
    ratio = np.sqrt(np.mean(np.square(errors), axis=0) / np.mean(np.square(sigmas), axis=0))
    assert (ratio > 0.4).all()
    assert (ratio < 1.6).all()  # the standard deviation of 16 draws is known to 18 %, and what is told of each to 30 %
    assert max(made.rms_m, 1e-9) < 0.003


def test_more_poses_are_known_better() -> None:
    few, many = (placed(told(count, 10050, robot_m=5e-4, robot_rad=1.7e-3)) for count in (8, 40))
    assert np.linalg.norm(many.sigma_m) < np.linalg.norm(few.sigma_m)


def test_too_few_poses_and_poses_about_one_axis_are_refused() -> None:
    with pytest.raises(ValueError, match="the board is seen in 5 poses of the hand; needed: 6 or more"):
        placed(told(5, 10000))
    with pytest.raises(ValueError, match=r"turned by \d+\.\d deg rms about one axis and 0\.\d about a second; needed"):
        placed(told(12, 10000, axes=1))


def test_poses_of_other_images_are_refused() -> None:
    given = told(7, 10000)
    names = list(given.hands)
    turned = dict(zip(names, [given.hands[name] for name in [*names[1:], names[0]]], strict=True))
    with pytest.raises(ValueError, match=r"leave \d+\.\d px between each other; allowed: 5"):
        placed(Told(given.views, turned))
    millimetres = {name: EndEffectorPose(1000 * one.place_m, one.rotation) for name, one in given.hands.items()}
    with pytest.raises(ValueError, match="lengths are metres"):
        placed(Told(given.views, millimetres))
