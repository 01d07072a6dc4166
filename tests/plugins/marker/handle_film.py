"""Rendered phone films of a person's swing with a printed marker on the cup's handle; the wrist turns the cup.

python -m tests.plugins.marker.handle_film FILM.mp4 [SWING [EXPOSURE_MS]]
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from kendama_cli.plugins.marker.detection import DICTIONARIES
from tests.plugins.films.swing_film import Filmed, Shoot, camera, filmed, person_swing, write_film

PHONE = Shoot(rate_hz=30.0, exposure_s=0.008)
"""720p, 65 degrees wide, 2 m away: a room with its lamps on."""
SIZE_M = 0.04
MARKER_TO_CUP_M = np.array([0.0, 0.045, -0.015])
"""The tie point in the marker's axes: 45 mm above the marker's centre and 15 mm behind the print."""
MARKER_AXES = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])
"""Columns: the marker's x, y and z (right, up, out of the print, to the camera) in the cup's axes."""
TURN_RAD = np.array([0.15, 0.25, 0.20])
"""The wrist's largest turn about x, y (in the swing's plane) and z."""
CELL_PX, SHUTTER_STEPS, FINER = 24, 7, 4
PAPER, INK = 205.0, 28.0
BLUR_PX, FULL_WELL_E = 0.7, 6000.0


def wrist(duration_s: float, t_s: float) -> np.ndarray:
    """The cup's axes (3, 3) at ``t_s``: upright at both ends."""
    u = np.clip(t_s / duration_s, 0, 1)
    size = np.array([np.sin(np.pi * u) ** 2, np.sin(2 * np.pi * u) * np.sin(np.pi * u) ** 2, np.sin(np.pi * u) ** 2])
    return cv2.Rodrigues(TURN_RAD * size)[0]


def filmed_with_marker(number: int, shoot: Shoot = PHONE, seed: int = 1) -> Filmed:
    """Film the bundled swing ``number`` with the marker on the handle."""
    swing, rng = person_swing(number), np.random.default_rng([seed, 1])
    length_s = float(swing.t_s[-1])
    film = filmed(swing, shoot, seed, lambda t_s: wrist(length_s, t_s))
    frames = []
    for frame, t_s in zip(film.frames, film.t_s, strict=True):
        at = t_s + shoot.exposure_s * np.linspace(-0.5, 0.5, SHUTTER_STEPS)
        cup_m = np.column_stack([np.interp(at, swing.t_s, one) for one in swing.cup_m.T])
        ways = [_print_to_image(cup, wrist(length_s, one), shoot) for cup, one in zip(cup_m, at, strict=True)]
        frames.append(_printed(frame, ways, rng))
    return replace(film, frames=frames)


def _texture() -> np.ndarray:
    """The print with its white edge (n, n, 2): its light, and where it is."""
    marker = cv2.aruco.getPredefinedDictionary(DICTIONARIES["4x4_50"])
    cells = cv2.aruco.generateImageMarker(marker, 0, CELL_PX * (marker.markerSize + 2)) > 0
    light = np.pad(np.where(cells, PAPER, INK), CELL_PX, constant_values=PAPER)
    return np.dstack([light, np.ones_like(light)]).astype(np.float32)


def _print_to_image(cup_m: np.ndarray, turn: np.ndarray, shoot: Shoot) -> np.ndarray:
    """The homography (3, 3) from the texture's pixels to the image's."""
    model, whole = camera(shoot), len(_texture())
    scale = SIZE_M / (whole - 2 * CELL_PX)
    middle = (whole - 1) / 2
    to_plane = np.array([[scale, 0, -scale * middle], [0, -scale, scale * middle], [0, 0, 1]])
    axes = turn @ MARKER_AXES
    centre = model.world_to_camera @ (cup_m - axes @ MARKER_TO_CUP_M - model.position_in_world_m)
    return model.optics.matrix @ np.column_stack(((model.world_to_camera @ axes)[:, :2], centre)) @ to_plane


def _printed(frame: np.ndarray, ways: list[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """The frame with the print before it, blurred over the exposure and by the lens, with the sensor's noise."""
    texture = _texture()
    edge = float(len(texture) - 1)
    square = np.array([[[0, 0], [edge, 0], [edge, edge], [0, edge]]])
    corners = np.concatenate([cv2.perspectiveTransform(square, way)[0] for way in ways])
    low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 4, 0)
    size = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 5, frame.shape[1::-1]) - low
    finer = np.array([[FINER, 0, (FINER - 1) / 2], [0, FINER, (FINER - 1) / 2], [0, 0, 1.0]])
    moved = np.array([[1, 0, -FINER * low[0]], [0, 1, -FINER * low[1]], [0, 0, 1.0]])
    shown = [cv2.warpPerspective(texture, moved @ finer @ way, (FINER * size).tolist()) for way in ways]
    seen = cv2.resize(np.mean(shown, axis=0), size.tolist(), interpolation=cv2.INTER_AREA)
    light, cover = np.moveaxis(cv2.GaussianBlur(seen, (0, 0), BLUR_PX), 2, 0)[..., None]
    noise = rng.normal(0, np.sqrt(light * 255 / FULL_WELL_E + 1), (*light.shape[:2], 3)) * cover
    made = frame.copy()
    part = made[low[1] : low[1] + size[1], low[0] : low[0] + size[0]]
    part[:] = np.clip(np.rint(part * (1 - cover) + light + noise), 0, 255)
    return made


if __name__ == "__main__":
    number, exposure_ms = sys.argv[2] if len(sys.argv) > 2 else 12, sys.argv[3] if len(sys.argv) > 3 else 8
    shoot = replace(PHONE, exposure_s=float(exposure_ms) / 1e3)
    write_film(Path(sys.argv[1]), filmed_with_marker(int(number), shoot), shoot.rate_hz)
