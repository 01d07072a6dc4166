"""Views of a ChArUco board by known cameras: each pixel's ray is followed to the board's plane."""

import functools

import cv2
import numpy as np

from kendama_cli.plugins.calibration.board import Board
from kendama_cli.vision.cameras.camera_model import CameraModel, looking_at

BOARD = Board(7, 5, 0.030, 0.022)
SCALE = 40
"""Pixels of the board's picture per square."""


def camera(name, position_m, target_m=(0.0, 0.0, 0.0)):
    """A camera of 640 x 480 px with a common lens."""
    focal = {"left": (600.0, 604.0), "right": (655.0, 651.0)}[name]
    return CameraModel(
        name=name, width_px=640, height_px=480, focal_px=np.array(focal), center_px=np.array([326.0, 235.0]),
        distortion=np.array([-0.12, 0.05, 0.0008, -0.0005, 0.0]),
        world_to_camera=looking_at(position_m, target_m), position_in_world_m=np.array(position_m, dtype=float),
    )  # fmt: skip


@functools.cache
def four_rays(lens, width_px, height_px):
    """Directions in the camera's axes (3, n), four per pixel."""
    v, u = np.indices((2 * height_px, 2 * width_px))
    flat = lens.undistort(np.column_stack([(u.ravel() - 0.5) / 2, (v.ravel() - 0.5) / 2]))
    return np.ascontiguousarray(np.column_stack([flat, np.ones(len(flat))]).T)


def pair():
    """Two cameras that look down on the place where the board is held."""
    return [camera("left", (-0.12, -0.16, 0.42)), camera("right", (0.14, -0.14, 0.44))]


def poses(count, seed):
    """Rotation (3, 3) and middle (3,) of the board: first flat at the origin, then held about it, tilted every way."""
    rng, made = np.random.default_rng(seed), [(np.eye(3), np.zeros(3))]
    for _ in range(count - 1):
        tilt = cv2.Rodrigues(np.append(rng.uniform(-0.6, 0.6, 2), rng.uniform(-0.7, 0.7)))[0]
        made.append((tilt, rng.uniform([-0.14, -0.10, -0.02], [0.14, 0.10, 0.16])))
    return made


def view(model, pose, *, noise=2.0, seed=0):
    """The board as ``model`` sees it (h, w, 3), print up in its own frame, before a grey wall."""
    rotation, middle_m = pose
    texture = BOARD.picture(SCALE).astype(np.float32)
    height, width = model.height_px * 2, model.width_px * 2
    origin = (model.position_in_world_m - middle_m) @ rotation
    x, y, z = (model.world_to_camera @ rotation).T @ four_rays(model.optics, model.width_px, model.height_px)
    t = -origin[2] / z
    columns = (origin[0] + t * x) * (SCALE / BOARD.square_m) + (BOARD.columns / 2 + 0.5) * SCALE - 0.5
    rows = (origin[1] + t * y) * (-SCALE / BOARD.square_m) + (BOARD.rows / 2 + 0.5) * SCALE - 0.5
    maps = [np.where(t > 0, m, -1e4).reshape(height, width).astype(np.float32) for m in (columns, rows)]
    seen = cv2.remap(texture, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=110)
    seen = cv2.resize(seen, (model.width_px, model.height_px), interpolation=cv2.INTER_AREA)  # the mean of four
    seen = 20 + 0.8 * seen + np.random.default_rng(seed).normal(0, noise, seen.shape)
    return np.repeat(np.clip(np.rint(seen), 0, 255).astype(np.uint8)[..., None], 3, axis=2)
