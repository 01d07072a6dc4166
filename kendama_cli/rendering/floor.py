"""A plain floor with a grid under an even sky, for films: what `Background` is for cameras that measure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import LightingSettings
from kendama_cli.vision.cameras.camera_model import CameraModel

PAPER, GRID = np.array([0.905, 0.91, 0.885]), np.array([0.66, 0.67, 0.66])
"""Linear light of the page's own tint and of the lines on the floor."""
SQUARE_M = 0.25
SHADOW = 0.34
"""How much of the floor's light the lamps send together."""
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
        share = SHADOW * parts / parts.sum()
        here = np.where(seen, 1 - far, 0.0)[..., None]
        self.unlit: NDArray[np.float32] = (light * (1 - share.sum() * here)).astype(np.float32)
        self.lit: NDArray[np.float32] = np.stack([light * part * here for part in share]).astype(np.float32)
