"""A board on a robot's hand before two cameras: where everything truly is, and what is told of it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from kendama_cli.plugins.calibration.board import BoardView
from kendama_cli.plugins.calibration.hand_eye import EndEffectorPose
from kendama_cli.vision.cameras.camera_model import CameraModel
from tests.plugins.calibration.board_views import BOARD, camera

MIDDLE_M = np.array([0.6, 0.1, 0.9])
"""Where the hand turns the board, in the robot's world."""
IN_HAND = (Rotation.from_euler("xyz", [0.3, -0.2, 0.5]).as_matrix(), np.array([0.03, -0.02, 0.11]))
"""The board's frame, in its middle with its print towards z, in the hand's."""


def cameras() -> list[CameraModel]:
    """Two cameras in the robot's world."""
    return [
        camera("left", MIDDLE_M + np.array([-0.15, -0.16, 0.45]), MIDDLE_M),
        camera("right", MIDDLE_M + np.array([0.17, -0.14, 0.47]), MIDDLE_M),
    ]


def calibrated(models: list[CameraModel]) -> list[CameraModel]:
    """The same, as 'camera calibrate' would tell them: in a world of their own."""
    turn, shift = Rotation.from_euler("xyz", [0.4, -0.7, 2.0]).as_matrix(), np.array([0.3, -0.2, 1.1])
    return [
        dataclasses.replace(
            one,
            world_to_camera=one.world_to_camera @ turn.T,
            position_in_world_m=turn @ one.position_in_world_m + shift,
        )
        for one in models
    ]


def hands(count: int, seed: int, *, axes: int = 3) -> list[EndEffectorPose]:
    """Poses that show the print to the cameras, turned by up to 25 deg about so many axes."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(count):
        vector = rng.uniform(-0.44, 0.44, 3) * (np.arange(3) < axes)
        board = Rotation.from_rotvec(vector).as_matrix()
        middle = MIDDLE_M + rng.uniform(-0.06, 0.06, 3)
        rotation = board @ IN_HAND[0].T
        made.append(EndEffectorPose(middle - rotation @ IN_HAND[1], rotation))
    return made


def board_pose(hand: EndEffectorPose) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and middle of the board in the robot's world."""
    return hand.rotation @ IN_HAND[0], hand.place_m + hand.rotation @ IN_HAND[1]


@dataclass(frozen=True)
class Told:
    """Input of the calibration: corners by camera, and the hand's poses as the robot tells them."""

    views: dict[str, list[BoardView]]
    hands: dict[str, EndEffectorPose]


def told(count: int, seed: int, *, axes: int = 3, robot_m: float = 0.0, robot_rad: float = 0.0) -> Told:
    """Corners to 0.1 px; the robot's poses are off by so much, each anew."""
    rng = np.random.default_rng(seed + 5000)
    true, views = hands(count, seed, axes=axes), {"left": [], "right": []}
    size_m = np.array([BOARD.columns, BOARD.rows, 0]) * BOARD.square_m
    flat = (BOARD.corners_m - size_m / 2) * [1, -1, -1]  # from the first corner, y down, to the middle, y up
    for number, hand in enumerate(true):
        rotation, middle = board_pose(hand)
        for model in cameras():
            pixels = model.project(middle + flat @ rotation.T) + 0.1 * rng.standard_normal((len(flat), 2))
            views[model.name].append(BoardView(str(number), np.arange(len(flat)), pixels))
    off = {
        str(number): EndEffectorPose(
            hand.place_m + robot_m * rng.standard_normal(3),
            Rotation.from_rotvec(robot_rad * rng.standard_normal(3)).as_matrix() @ hand.rotation,
        )
        for number, hand in enumerate(true)
    }
    return Told(views, off)
