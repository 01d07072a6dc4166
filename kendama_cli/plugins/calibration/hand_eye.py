"""Robot-world/hand-eye calibration: poses of cameras in a robot's world, from a board on its hand.

For pose i of the hand G_i (hand in the robot's world) a camera sees the board at C_i (board in the cameras' world).
With Z (the cameras' world in the robot's) and X (the board in the hand): Z C_i = G_i X. The start is linear, rotations
before translations (M. Shah, "Solving the robot-world/hand-eye calibration problem using the Kronecker product",
J. Mechanisms Robotics 5(3), 2013); then all corners' pixels are fitted. OpenCV 5 has no calibrateRobotWorldHandEye.

Cameras on a link G_i before a board that stands still are the same equation: with Z (the cameras' world in the link)
and X (the board in the robot's world) the board is at G_i Z C_i = X, hence Z C_i = G_i^-1 X.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from kendama_cli.plugins.calibration.board import Board, BoardView
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel

LEAST_POSES = 6
LEAST_TURN_DEG = 15.0
"""About a second axis; turned about one only, the hand tells nothing of the board's place along it."""
MOST_LEFT_PX = 5.0
"""Corners are found to a tenth of a pixel: what leaves more are poses of other images, or of another frame."""


@dataclass(frozen=True)
class EndEffectorPose:
    """The hand in the robot's world: ``place_m`` (3,), ``rotation`` (3, 3)."""

    place_m: Array
    rotation: Array

    def inverse(self) -> EndEffectorPose:
        """Return the robot's world in the hand."""
        return EndEffectorPose(-self.rotation.T @ self.place_m, self.rotation.T)


@dataclass(frozen=True)
class PlacedCameras:
    """Cameras in the robot's world, the board in the hand, and standard deviations (3,) of the cameras' world.

    Of cameras on a link (see ``place_on_link``): in the link, and the board in the robot's world.
    ``sigma_m`` is of where the cameras stand in the mean, ``sigma_rad`` of their rotation about the robot's axes.
    ``rms_px`` is what the corners leave, ``rms_m`` the same at the board, ``views`` how many images were used.
    """

    cameras: tuple[CameraModel, ...]
    board_in_hand_m: Array
    board_in_hand: Array
    sigma_m: Array
    sigma_rad: Array
    rms_px: float
    rms_m: float
    views: int


@dataclass(frozen=True)
class _Sight:
    """One image: its hand, the camera, corners on the board (n, 3), their pixels (n, 2), the board's pose (4, 4)."""

    hand: Array
    camera: CameraModel
    corners_m: Array
    pixels: Array
    board: Array


def place_cameras(
    board: Board,
    cameras: Sequence[CameraModel],
    views: Mapping[str, Sequence[BoardView]],
    hands: Mapping[str, EndEffectorPose],
) -> PlacedCameras:
    """Place cameras, calibrated in one world, in the robot's by views of a board on its hand.

    ``views`` by camera and ``hands`` have the same names. Raises ValueError, in one line, for too few poses, for a hand
    that is turned about one axis only, and for poses that do not fit the images.
    """
    by_name = {camera.name: camera for camera in cameras}
    sights = [
        _sight(board, by_name[name], view, hands[view.name])
        for name, seen in views.items()
        for view in seen
        if view.name in hands
    ]
    _check_poses([sight.hand for sight in sights])
    start = np.concatenate([_vector(one) for one in _linear_start(sights)])
    fit = least_squares(_residuals, start, args=(sights,), x_scale="jac", loss="linear")
    left = fit.fun.reshape(-1, 2)
    rms_px = float(np.sqrt((left**2).sum(axis=1).mean()))
    if rms_px > MOST_LEFT_PX:
        raise ValueError(
            f"images and poses of the hand leave {rms_px:.1f} px between each other; allowed: {MOST_LEFT_PX:g}: see "
            "that each pose belongs to its image, that lengths are metres, and that the board did not slip"
        )
    placed, in_hand = _matrix(fit.x[:6]), _matrix(fit.x[6:])
    made = tuple(_moved(camera, placed) for camera in cameras)
    sigma = _jackknife(fit, sights, np.mean([camera.position_in_world_m for camera in cameras], axis=0))
    away_m = np.mean([np.linalg.norm(sight.board[:3, 3]) for sight in sights])
    focal_px = np.mean([camera.focal_px.mean() for camera in cameras])
    return PlacedCameras(
        cameras=made,
        board_in_hand_m=in_hand[:3, 3],
        board_in_hand=in_hand[:3, :3],
        sigma_m=sigma[:3],
        sigma_rad=sigma[3:],
        rms_px=rms_px,
        rms_m=rms_px * float(away_m / focal_px),
        views=len(sights),
    )


def place_on_link(
    link: str,
    board: Board,
    cameras: Sequence[CameraModel],
    views: Mapping[str, Sequence[BoardView]],
    links: Mapping[str, EndEffectorPose],
) -> PlacedCameras:
    """Place cameras on ``link``, of poses ``links``, by views of a board that stands still; see place_cameras."""
    made = place_cameras(board, cameras, views, {name: pose.inverse() for name, pose in links.items()})
    return dataclasses.replace(made, cameras=tuple(dataclasses.replace(one, link=link) for one in made.cameras))


def _sight(board: Board, camera: CameraModel, view: BoardView, hand: EndEffectorPose) -> _Sight:
    corners = board.corners_m[view.ids]
    _, turn, shift = cv2.solvePnP(corners, view.pixels, camera.optics.matrix, camera.optics.distortion)
    return _Sight(
        _pose(hand.rotation, hand.place_m),
        camera,
        corners,
        view.pixels,
        _pose(np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64), np.asarray(shift, dtype=np.float64)),
    )


def _check_poses(hands: Sequence[Array]) -> None:
    poses = {hand.tobytes() for hand in hands}
    if len(poses) < LEAST_POSES:
        raise ValueError(f"the board is seen in {len(poses)} poses of the hand; needed: {LEAST_POSES} or more")
    turns = Rotation.from_matrix([hand[:3, :3] for hand in hands])
    spread = (turns * turns.mean().inv()).as_rotvec()
    sizes = np.degrees(np.linalg.svd(spread / np.sqrt(len(spread)), compute_uv=False))
    if sizes[1] < LEAST_TURN_DEG / 3:
        raise ValueError(
            f"the hand is turned by {sizes[0]:.1f} deg rms about one axis and {sizes[1]:.1f} about a second; needed: "
            f"{LEAST_TURN_DEG / 3:g} or more about two: turn it by {LEAST_TURN_DEG:g} deg to all sides"
        )


def _linear_start(sights: Sequence[_Sight]) -> tuple[Array, Array]:
    """Solve for Z and X by Shah's linear solution."""
    seen = [_world(sight.camera) @ sight.board for sight in sights]
    rows = [
        np.hstack([np.kron(np.eye(3), one[:3, :3].T), -np.kron(sight.hand[:3, :3], np.eye(3))])
        for one, sight in zip(seen, sights, strict=True)
    ]
    null = np.linalg.svd(np.vstack(rows))[2][-1]
    turns = [_nearest_rotation(part.reshape(3, 3)) for part in (null[:9], null[9:])]
    if np.linalg.det(null[:9].reshape(3, 3)) < 0:
        turns = [_nearest_rotation(-part.reshape(3, 3)) for part in (null[:9], null[9:])]
    system = np.vstack([np.hstack([np.eye(3), -sight.hand[:3, :3]]) for sight in sights])
    target = np.concatenate(
        [sight.hand[:3, 3] - turns[0] @ one[:3, 3] for one, sight in zip(seen, sights, strict=True)]
    )
    shifts = np.linalg.lstsq(system, target, rcond=None)[0]
    return _pose(turns[0], shifts[:3]), _pose(turns[1], shifts[3:])


def _residuals(parameters: Array, sights: Sequence[_Sight]) -> Array:
    """Return projected less seen corners [px], two for each corner, image by image."""
    from_robot, in_hand = np.linalg.inv(_matrix(parameters[:6])), _matrix(parameters[6:])
    left = []
    for sight in sights:
        to_camera = np.linalg.inv(_world(sight.camera)) @ from_robot @ sight.hand @ in_hand
        turn = cv2.Rodrigues(to_camera[:3, :3])[0]
        pixels = sight.camera.optics.posed(sight.corners_m, turn, to_camera[:3, 3])[0]
        left.append((pixels - sight.pixels).ravel())
    return np.concatenate(left)


def _jackknife(fit: Any, sights: Sequence[_Sight], centre_m: Array) -> Array:
    """Return standard deviations (6,) of the cameras' pose: the fit without each pose of the hand in turn.

    One step of Gauss-Newton tells how it moves. Whole poses are left out, for a robot's error is the same in all
    corners of an image.
    """
    hands = [sight.hand.tobytes() for sight in sights]
    owner = np.repeat([hands.index(one) for one in hands], [2 * len(sight.pixels) for sight in sights])
    names = sorted(set(owner.tolist()))
    moved = []
    for name in names:
        kept = owner != name
        step = np.linalg.lstsq(fit.jac[kept], -fit.fun[kept], rcond=None)[0]
        moved.append(_place_and_turn(fit.x, fit.x + step, centre_m))
    away = np.array(moved)
    count = len(names)
    return np.asarray(np.sqrt((count - 1) / count * ((away - away.mean(axis=0)) ** 2).sum(axis=0)))


def _place_and_turn(before: Array, after: Array, centre_m: Array) -> Array:
    """Return the displacement of ``centre_m``, in the cameras' world, and the rotation vector of its turn."""
    one, other = _matrix(before[:6]), _matrix(after[:6])
    shift = (other[:3, :3] - one[:3, :3]) @ centre_m + other[:3, 3] - one[:3, 3]
    return np.concatenate([shift, Rotation.from_matrix(other[:3, :3] @ one[:3, :3].T).as_rotvec()])


def _moved(camera: CameraModel, placed: Array) -> CameraModel:
    pose = placed @ _world(camera)
    return dataclasses.replace(camera, world_to_camera=pose[:3, :3].T, position_in_world_m=pose[:3, 3])


def _world(camera: CameraModel) -> Array:
    """Return the camera's axes and place in the cameras' world (4, 4)."""
    return _pose(camera.world_to_camera.T, camera.position_in_world_m)


def _pose(rotation: Array, place_m: Array) -> Array:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation, np.ravel(place_m)
    return made


def _vector(pose: Array) -> Array:
    return np.concatenate([Rotation.from_matrix(pose[:3, :3]).as_rotvec(), pose[:3, 3]])


def _matrix(vector: Array) -> Array:
    return _pose(Rotation.from_rotvec(vector[:3]).as_matrix(), vector[3:])


def _nearest_rotation(matrix: Array) -> Array:
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)
