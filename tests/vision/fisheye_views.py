"""Cameras with wide lenses, and what they see of a board."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np

from kendama_cli.vision.calibration import Board, BoardView
from kendama_cli.vision.camera_model import CameraModel, looking_at

SIZE = (640, 480)
BOARD = Board(9, 6, 0.040, 0.030)
CORNERS_M = BOARD.corners_m - np.array([BOARD.columns, BOARD.rows, 0]) * BOARD.square_m / 2
UPRIGHT = cv2.Rodrigues(np.array([np.pi / 2, 0.0, 0.0]))[0]
WIDE = (-0.02, 0.006, -0.002, 0.0004, 0.0)


def wide(position_m=(0.0, 0.0, 0.0), target_m=(0.0, 1.0, 0.0), numbers=WIDE, focal=262.0) -> CameraModel:
    """A camera of 140 degrees across the image."""
    return CameraModel(
        name="wide", width_px=SIZE[0], height_px=SIZE[1], focal_px=np.array([focal, focal + 1.5]),
        center_px=np.array([318.0, 241.0]), distortion=np.array(numbers), lens="fisheye",
        world_to_camera=looking_at(position_m, target_m), position_in_world_m=np.array(position_m, dtype=float),
    )  # fmt: skip


def pair(rng: np.random.Generator, lens: Literal["radial", "fisheye"]) -> list[CameraModel]:
    """Two cameras 0.7 m apart: of 120 to 150 degrees, or of about 60."""
    made = []
    for name, x in (("left", -0.35), ("right", 0.35)):
        if lens == "fisheye":
            focal = SIZE[0] / np.radians(rng.uniform(120, 150))
            numbers = np.array([*(rng.uniform(-most, most) for most in (0.04, 0.01, 0.004, 0.001)), 0.0])
        else:
            focal = rng.uniform(450, 650)
            numbers = np.array([rng.uniform(-0.2, 0.05), rng.uniform(-0.05, 0.08), *rng.normal(0, 0.0006, 2), 0.0])
        place = (x, -0.6 if lens == "fisheye" else -1.0, 0.1)
        made.append(
            CameraModel(
                name, *SIZE, np.array([focal, focal * rng.uniform(0.995, 1.005)]),
                np.array([320, 240]) + rng.normal(0, 6, 2), numbers, looking_at(place, (0, 0, 0)), np.array(place),
                lens,
            )
        )  # fmt: skip
    return made


def views_of(cameras: list[CameraModel], rng: np.random.Generator, count: int) -> dict[str, list[BoardView]]:
    """Corners with 0.2 px of noise."""
    made: dict[str, list[BoardView]] = {camera.name: [] for camera in cameras}
    for number in range(count):
        turn = UPRIGHT @ cv2.Rodrigues(np.append(rng.uniform(-0.6, 0.6, 2), rng.uniform(-0.7, 0.7)))[0]
        middle = rng.uniform([-0.5, -0.3, -0.4], [0.5, 0.4, 0.4])
        for camera in cameras:
            pixels = camera.project((CORNERS_M * [1, -1, -1]) @ turn.T + middle)
            ids = np.flatnonzero(((pixels > 5) & (pixels < np.array(SIZE) - 5)).all(axis=1))
            if len(ids) >= 12:
                seen = pixels[ids] + rng.normal(0, 0.2, (len(ids), 2))
                made[camera.name].append(BoardView(f"{number:03d}", ids, seen))
    return made


def off_mm(models: list[CameraModel], true: list[CameraModel]) -> float:
    """Median error of the distances of 200 pairs of points in a volume of 0.6 m."""
    ends = np.random.default_rng(1).uniform(-0.3, 0.3, (2, 200, 3))
    found = [_places(models, true, points) for points in ends]
    apart = np.linalg.norm(found[0] - found[1], axis=1) - np.linalg.norm(ends[0] - ends[1], axis=1)
    return float(1e3 * np.median(np.abs(apart)))


def _places(models: list[CameraModel], true: list[CameraModel], points_m: np.ndarray) -> np.ndarray:
    """Where ``models`` put what ``true`` cameras see: nearest to both rays."""
    made = []
    for point in points_m:
        left, right = np.zeros((3, 3)), np.zeros(3)
        for model, camera in zip(models, true, strict=True):
            ray = model.rays(camera.project(point[None]))[0]
            across = np.eye(3) - np.outer(ray, ray) / (ray @ ray)
            left, right = left + across, right + across @ model.position_in_world_m
        made.append(np.linalg.solve(left, right))
    return np.array(made)
