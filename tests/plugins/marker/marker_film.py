"""Films of a printed marker that moves as one wants: warped, blurred over the exposure, noisy."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from kendama_cli.plugins.marker.detection import DICTIONARIES
from kendama_cli.vision.cameras.camera_model import CameraModel

WIDTH, HEIGHT, FOCAL = 640, 480, 600.0
FIELD_DEG = float(np.degrees(2 * np.arctan(WIDTH / 2 / FOCAL)))
LEVEL = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])
CAMERA = CameraModel(
    "film",
    WIDTH,
    HEIGHT,
    np.full(2, FOCAL),
    np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2]),
    np.zeros(5),
    LEVEL,
    np.zeros(3),
)
FACING = np.diag([1.0, -1.0, -1.0])
"""The marker's axes (x right, y up, z out of the print) in the camera's frame where it faces the camera upright."""
FINER = 4


def turned(vector_rad):
    """The marker's axes in the camera's frame, turned by ``vector_rad`` from facing it."""
    return cv2.Rodrigues(np.asarray(vector_rad, dtype=np.float64))[0] @ FACING


def picture(places_m, rotations, size_m, rng, *, dictionary="4x4_50", number=0, noise=2.0):
    """One frame: the mean over the exposure of the marker at ``places_m`` (s, 3), ``rotations`` (s, 3, 3)."""
    printed = cv2.aruco.getPredefinedDictionary(DICTIONARIES[dictionary])
    cell = 40
    side = cell * (printed.markerSize + 2)
    marker = cv2.copyMakeBorder(
        cv2.aruco.generateImageMarker(printed, number, side), cell, cell, cell, cell, cv2.BORDER_CONSTANT, value=255
    ).astype(np.float32)
    wall = np.full((HEIGHT, WIDTH), 120.0, dtype=np.float32)
    scale, middle = size_m / side, cell + side / 2 - 0.5
    to_plane = np.array([[scale, 0, -scale * middle], [0, -scale, scale * middle], [0, 0, 1]])
    finer = np.array([[FINER, 0, (FINER - 1) / 2], [0, FINER, (FINER - 1) / 2], [0, 0, 1.0]])
    total = np.zeros_like(wall)
    for place, rotation in zip(places_m, rotations, strict=True):
        to_image = CAMERA.optics.matrix @ np.column_stack((rotation[:, :2], place)) @ to_plane
        edge = float(len(marker) - 1)
        corners = cv2.perspectiveTransform(np.array([[[0, 0], [edge, 0], [edge, edge], [0, edge]]]), to_image)[0]
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 2, 0)
        high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 3, [WIDTH, HEIGHT])
        frame = wall.copy()
        if (high > low).all():
            shape = tuple(int(n) for n in (high - low) * FINER)
            part = np.full(shape[::-1], 120.0, dtype=np.float32)
            moved = np.array([[1, 0, -FINER * low[0]], [0, 1, -FINER * low[1]], [0, 0, 1.0]])
            cv2.warpPerspective(marker, moved @ finer @ to_image, shape, dst=part, borderMode=cv2.BORDER_TRANSPARENT)
            inside = cv2.resize(part, tuple(int(n) for n in high - low), interpolation=cv2.INTER_AREA)
            frame[low[1] : high[1], low[0] : high[0]] = inside
        total += frame
    return np.clip(total / len(places_m) + rng.normal(0, noise, wall.shape), 0, 255).astype(np.uint8)


def write_film(path: Path, t_s, place_m, corners_rad, *, rate_hz, exposure_s, size_m=0.04, seed=10000, hidden=()):
    """A film of the marker at ``place_m`` (n, 3) in the world of a level camera, turned by ``corners_rad`` (n, 3)."""
    rng = np.random.default_rng(seed)
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate_hz, (WIDTH, HEIGHT))
    for count in range(int((t_s[-1] - t_s[0]) * rate_hz)):
        at = t_s[0] + count / rate_hz + exposure_s * np.linspace(-0.5, 0.5, 6)
        places = np.column_stack([np.interp(at, t_s, column) for column in place_m.T]) @ LEVEL.T
        turns = np.column_stack([np.interp(at, t_s, column) for column in corners_rad.T])
        seen = [] if count in hidden else [turned(turn) for turn in turns]
        frame = picture(places, seen, size_m, rng) if seen else np.full((HEIGHT, WIDTH), 120, np.uint8)
        film.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
    film.release()
    return path
