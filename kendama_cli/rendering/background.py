"""Backgrounds of the scene: a wall and a table, rendered once for each camera, and a floor for videos."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import InputError
from kendama_cli.rendering.tiles import Tiles
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import AppearanceSettings, LightingSettings
from kendama_cli.vision.cameras.camera_model import CameraModel

FAR = 1e3
"""Where a ray meets neither wall nor table, its end lies this many focal lengths away."""
WALL_IMAGE_M = 3.0
"""Width of an image on the wall, centred on x = 0 and z = 0."""
GAMMA = 2.2
"""Exponent of images, whose numbers are light^(1 / gamma)."""


@dataclass(frozen=True)
class _ByValue:
    """A camera that equals another with the same numbers."""

    numbers: tuple[object, ...]
    model: CameraModel = field(compare=False)


def background(
    model: CameraModel, appearance: AppearanceSettings, lighting: LightingSettings
) -> tuple[Background, Tiles]:
    """Return the background of a camera and its tiles; nobody may write to them.

    Those of the last two cameras are cached for a pair that is opened again; with an image on the wall,
    whose file may change, they are made anew.
    """
    pose = (model.world_to_camera.tobytes(), model.position_in_world_m.tobytes())
    camera = _ByValue((model.width_px, model.height_px, model.optics, *pose), model)
    make = _background if appearance.wall_image is None else _background.__wrapped__
    return make(camera, appearance, lighting)


@functools.lru_cache(maxsize=2)
def _background(
    camera: _ByValue, appearance: AppearanceSettings, lighting: LightingSettings
) -> tuple[Background, Tiles]:
    made = Background(camera.model, appearance, lighting)
    return made, Tiles(made.rays, made.points, made.lit, np.array(camera.model.position_in_world_m, dtype=np.float64))


class Background:
    """View of each pixel without bodies before it.

    ``rays`` and ``points`` (h, w, 3): the pixel's ray, as ``CameraModel.rays`` has it, and where it ends;
    ``unlit`` (h, w, 3) its light without lamps, ``lit`` (lamps, h, w, 3) what each unhidden lamp of strength 1 adds.
    """

    def __init__(self, model: CameraModel, appearance: AppearanceSettings, lighting: LightingSettings) -> None:
        columns, rows = np.meshgrid(np.arange(model.width_px), np.arange(model.height_px))
        pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)
        self.rays: Array = np.ascontiguousarray(model.rays(pixels).reshape(model.height_px, model.width_px, 3))
        origin = model.position_in_world_m
        with np.errstate(divide="ignore", invalid="ignore"):
            to_wall = (appearance.wall_y_m - origin[1]) / self.rays[..., 1]
            to_table = (appearance.table_z_m - origin[2]) / self.rays[..., 2]
        to_wall = np.where(to_wall > 0, np.minimum(to_wall, FAR), FAR)
        on_table = (to_table > 0) & (to_table < to_wall)
        self.points: Array = origin + np.where(on_table, to_table, to_wall)[..., None] * self.rays
        x, y, z = np.moveaxis(self.points, -1, 0)
        pattern = np.where(
            on_table,
            1 + 0.12 * np.sin(40 * x + 3 * np.sin(6 * y)) * np.sin(5 * y),
            1 + 0.10 * np.sin(9 * x) * np.sin(11 * z) + 0.06 * np.sin(23 * x + 1) * np.sin(19 * z),
        )
        wall = np.array(appearance.wall_rgb) * pattern[..., None]
        if appearance.wall_image is not None:
            wall = _image(Path(appearance.wall_image), x, z)
        paint = np.where(on_table[..., None], np.array(appearance.table_rgb) * pattern[..., None], wall)
        glow = np.where(on_table, 0.0, lighting.wall_glow)
        normal = np.where(on_table[..., None], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0])
        self.unlit: NDArray[np.float32] = (lighting.ambient * paint + glow[..., None]).astype(np.float32)
        self.lit: NDArray[np.float32] = np.zeros((len(lighting.lamps), *self.unlit.shape), dtype=np.float32)
        for lit, lamp in zip(self.lit, lighting.lamps, strict=True):
            towards = np.array(lamp.position_m) - self.points
            cosine = np.maximum((normal * towards).sum(axis=2) / np.linalg.norm(towards, axis=2), 0.0)
            lit[...] = paint * (lamp.irradiance * cosine)[..., None]


def _image(path: Path, x_m: Array, z_m: Array) -> Array:
    """Return the linear reflectance (h, w, 3), RGB, of an image on the wall; mirrored on beyond its edges."""
    try:
        image = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
    except cv2.error:  # beyond the limit that kendama_cli sets
        image = None
    if image is None:
        raise InputError(str(path), "no image that can be read", remedy="give a PNG or JPEG file")
    height, width = image.shape[:2]
    per_m = width / WALL_IMAGE_M
    columns, rows = (width - 1) / 2 + per_m * x_m, (height - 1) / 2 - per_m * z_m
    shown = cv2.remap(
        image, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_AREA, borderMode=cv2.BORDER_REFLECT
    )
    return np.asarray((shown / 255.0) ** GAMMA)


PAPER, GRID = np.array([0.905, 0.91, 0.885]), np.array([0.66, 0.67, 0.66])
"""Linear light of the page's own tint and of the lines on the floor."""
SQUARE_M = 0.25
SHADOW = 0.34
"""Fraction of the floor's light that the lamps send together."""
_LINE_M, _FADE_M, _FAR_M = 0.004, (2.5, 5.5), 50.0


class Floor:
    """The floor at z = 0, light as paper away from shadows, with lines every SQUARE_M that fade into the distance."""

    def __init__(self, model: CameraModel, lighting: LightingSettings) -> None:
        columns, rows = np.meshgrid(np.arange(model.width_px), np.arange(model.height_px))
        pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)
        self.rays: Array = np.ascontiguousarray(model.rays(pixels).reshape(model.height_px, model.width_px, 3))
        origin = np.asarray(model.position_in_world_m)
        with np.errstate(divide="ignore", invalid="ignore"):
            down = -origin[2] / self.rays[..., 2]
        seen = (down > 0) & (down < _FAR_M)
        reach = np.where(seen, down, _FAR_M)
        self.points: Array = origin + reach[..., None] * self.rays
        wide_m = np.maximum(_LINE_M, reach / float(model.focal_px.min()))  # at least one pixel wide
        apart = np.abs((self.points[..., :2] / SQUARE_M + 0.5) % 1 - 0.5) * SQUARE_M
        ink = np.clip(1.2 - apart.min(axis=2) / wide_m, 0.0, 1.0) * _LINE_M / wide_m
        from_middle = np.linalg.norm(self.points[..., :2], axis=2)
        far = np.clip((from_middle - _FADE_M[0]) / (_FADE_M[1] - _FADE_M[0]), 0.0, 1.0)
        strength = np.where(seen, ink * (1 - far), 0.0)[..., None]
        light = PAPER * (1 - strength) + GRID * strength
        # a lamp's part of the paper's light is what its shadow takes away; in the distance there are no shadows
        parts = np.array([lamp.irradiance for lamp in lighting.lamps])
        fraction = SHADOW * parts / parts.sum()
        here = np.where(seen, 1 - far, 0.0)[..., None]
        self.unlit: NDArray[np.float32] = (light * (1 - fraction.sum() * here)).astype(np.float32)
        self.lit: NDArray[np.float32] = np.stack([light * part * here for part in fraction]).astype(np.float32)
