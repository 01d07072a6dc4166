"""What is behind the scene: a wall and a table, seen once by each camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import AppearanceSettings, LightingSettings
from kendama_cli.vision.camera_model import CameraModel

FAR = 1e3
"""Where a ray meets neither wall nor table, its end lies this many focal lengths away."""


class Background:
    """What each pixel sees where no body stands before it.

    ``rays`` and ``points`` (h, w, 3): the pixel's ray, of length 1 along the optical axis, and where it ends;
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
        paint = np.where(on_table[..., None], appearance.table_rgb, appearance.wall_rgb) * pattern[..., None]
        glow = np.where(on_table, 0.0, lighting.wall_glow)
        normal = np.where(on_table[..., None], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0])
        self.unlit: NDArray[np.float32] = (lighting.ambient * paint + glow[..., None]).astype(np.float32)
        self.lit: NDArray[np.float32] = np.zeros((len(lighting.lamps), *self.unlit.shape), dtype=np.float32)
        for lit, lamp in zip(self.lit, lighting.lamps, strict=True):
            way = np.array(lamp.position_m) - self.points
            cosine = np.maximum((normal * way).sum(axis=2) / np.linalg.norm(way, axis=2), 0.0)
            lit[...] = paint * (lamp.irradiance * cosine)[..., None]
