"""Background of the scene: a wall and a table, rendered once for each camera."""

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
"""Width of a picture on the wall, in the middle of which x = 0 and z = 0."""
GAMMA = 2.2
"""Of pictures, whose numbers are light^(1 / gamma)."""


@dataclass(frozen=True)
class _ByValue:
    """A camera that equals another with the same numbers."""

    numbers: tuple[object, ...]
    model: CameraModel = field(compare=False)


def background(
    model: CameraModel, appearance: AppearanceSettings, lighting: LightingSettings
) -> tuple[Background, Tiles]:
    """Return the background of a camera and its tiles; nobody may write to them.

    Those of the last two cameras are kept, so that a pair that is opened again has them; with a picture on the wall,
    whose file may change, they are made anew.
    """
    place = (model.world_to_camera.tobytes(), model.position_in_world_m.tobytes())
    camera = _ByValue((model.width_px, model.height_px, model.optics, *place), model)
    make = _background if appearance.wall_image is None else _background.__wrapped__
    return make(camera, appearance, lighting)


@functools.lru_cache(maxsize=2)
def _background(
    camera: _ByValue, appearance: AppearanceSettings, lighting: LightingSettings
) -> tuple[Background, Tiles]:
    made = Background(camera.model, appearance, lighting)
    return made, Tiles(made.rays, made.points, made.lit, np.array(camera.model.position_in_world_m, dtype=np.float64))


class Background:
    """View of each pixel before which no body stands.

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
            wall = _picture(Path(appearance.wall_image), x, z)
        paint = np.where(on_table[..., None], np.array(appearance.table_rgb) * pattern[..., None], wall)
        glow = np.where(on_table, 0.0, lighting.wall_glow)
        normal = np.where(on_table[..., None], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0])
        self.unlit: NDArray[np.float32] = (lighting.ambient * paint + glow[..., None]).astype(np.float32)
        self.lit: NDArray[np.float32] = np.zeros((len(lighting.lamps), *self.unlit.shape), dtype=np.float32)
        for lit, lamp in zip(self.lit, lighting.lamps, strict=True):
            way = np.array(lamp.position_m) - self.points
            cosine = np.maximum((normal * way).sum(axis=2) / np.linalg.norm(way, axis=2), 0.0)
            lit[...] = paint * (lamp.irradiance * cosine)[..., None]


def _picture(path: Path, x_m: Array, z_m: Array) -> Array:
    """Return the linear reflectance (h, w, 3), RGB, of a picture on the wall; mirrored on beyond its edges."""
    try:
        picture = cv2.imread(str(path), cv2.IMREAD_COLOR_RGB)
    except cv2.error:  # beyond the limit that kendama_cli sets
        picture = None
    if picture is None:
        raise InputError(str(path), "no picture that can be read", remedy="give a PNG or JPEG file")
    height, width = picture.shape[:2]
    per_m = width / WALL_IMAGE_M
    columns, rows = (width - 1) / 2 + per_m * x_m, (height - 1) / 2 - per_m * z_m
    shown = cv2.remap(
        picture, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_AREA, borderMode=cv2.BORDER_REFLECT
    )
    return np.asarray((shown / 255.0) ** GAMMA)
