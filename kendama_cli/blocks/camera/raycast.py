"""Images of moving shapes by ray casting: lens distortion, Lambert shading, shadows, motion blur."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.checks import Array
from kendama_cli.blocks.camera.shapes import Capsule, Shape
from kendama_cli.settings.camera import AppearanceSettings, LightingSettings
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.region import Region, whole

MOMENTS = np.array([[15, 2, 1, 12], [4, 9, 10, 7], [8, 5, 6, 11], [3, 14, 13, 0]], dtype=np.float64)
"""Order in time of a pixel's 4 x 4 samples: Duerer's magic square, so that time correlates with neither direction."""
TILE_PX = 64
LIFT_M = 1e-6


@dataclass(frozen=True)
class Body:
    """A shape as it stands at mid-exposure, its velocity, and whether it throws a shadow."""

    shape: Shape
    velocity_m_s: Array
    shadow: bool


@dataclass(frozen=True)
class Exposure:
    """What stands before the camera while it exposes: bodies with their footprints, and the lamps' strength."""

    bodies: Sequence[Body]
    footprints: Sequence[Footprint]
    duration_s: float
    strength: float


@dataclass(frozen=True)
class Footprint:
    """Where a body may show in the image: within ``half_px`` of the segment from ``a_px`` to ``b_px``."""

    box: Region
    a_px: Array
    b_px: Array
    half_px: float

    def pixels(self, part: Region) -> NDArray[np.intp]:
        """Flat indices, row by row, of the pixels of ``part`` that belong to the footprint."""
        columns = np.arange(part.left, part.right) - self.a_px[0]
        rows = (np.arange(part.top, part.bottom) - self.a_px[1])[:, None]
        along = self.b_px - self.a_px
        length2 = float(along @ along)
        share = np.clip((columns * along[0] + rows * along[1]) / length2, 0.0, 1.0) if length2 > 0 else 0.0
        off2 = (columns - share * along[0]) ** 2 + (rows - share * along[1]) ** 2
        return np.flatnonzero(off2 <= self.half_px**2)


class Raycaster:
    """One camera's view of a room with a wall and a table, and of bodies in it.

    Each pixel takes 16 samples, spread over its area and over the exposure; the room takes one, at mid-exposure.
    Light is linear: reflectance times irradiance, red, green, blue.
    """

    def __init__(self, model: CameraModel, appearance: AppearanceSettings, lighting: LightingSettings) -> None:
        self.model = model
        self.lighting = lighting
        columns, rows = np.meshgrid(np.arange(model.width_px), np.arange(model.height_px))
        pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)
        self._rays = model.rays(pixels).reshape(model.height_px, model.width_px, 3)
        self._by_column = np.asarray(np.gradient(self._rays, axis=1))
        self._by_row = np.asarray(np.gradient(self._rays, axis=0))
        offset = (np.arange(4) - 1.5) / 4
        self._right, self._down = np.tile(offset, 4), np.repeat(offset, 4)
        self._all = whole(model.width_px, model.height_px)
        self._moment = (MOMENTS.ravel() + 0.5) / 16 - 0.5
        self._lamps = [np.array(lamp.position_m) for lamp in lighting.lamps]
        self._room(appearance)

    def render(self, bodies: Sequence[Body], region: Region, t_s: float, exposure_s: float) -> NDArray[np.float32]:
        """Mean light (h, w, 3) over the exposure about ``t_s`` in ``region``, which must lie in the image."""
        image = np.empty((region.bottom - region.top, region.right - region.left, 3), dtype=np.float32)
        footprints = [self._footprint(body, exposure_s) for body in bodies]
        shot = Exposure(bodies, footprints, exposure_s, self._flicker(t_s, exposure_s))
        for top in range(region.top, region.bottom, TILE_PX):
            for left in range(region.left, region.right, TILE_PX):
                tile = Region(left, top, left + TILE_PX, top + TILE_PX).within(region)
                rows = slice(tile.top - region.top, tile.bottom - region.top)
                columns = slice(tile.left - region.left, tile.right - region.left)
                image[rows, columns] = self._tile(shot, tile)
        return image

    def _room(self, appearance: AppearanceSettings) -> None:
        """The wall and the table, seen once: where they are, their light without lamps, and each lamp's share."""
        origin = self.model.position_in_world_m
        with np.errstate(divide="ignore", invalid="ignore"):
            to_wall = (appearance.wall_y_m - origin[1]) / self._rays[..., 1]
            to_table = (appearance.table_z_m - origin[2]) / self._rays[..., 2]
        to_wall = np.where(to_wall > 0, to_wall, 1e3)
        on_table = (to_table > 0) & (to_table < to_wall)
        self._points = origin + np.where(on_table, to_table, to_wall)[..., None] * self._rays
        x, y, z = np.moveaxis(self._points, -1, 0)
        pattern = np.where(
            on_table,
            1 + 0.12 * np.sin(40 * x + 3 * np.sin(6 * y)) * np.sin(5 * y),
            1 + 0.10 * np.sin(9 * x) * np.sin(11 * z) + 0.06 * np.sin(23 * x + 1) * np.sin(19 * z),
        )
        paint = np.where(on_table[..., None], appearance.table_rgb, appearance.wall_rgb) * pattern[..., None]
        glow = np.where(on_table, 0.0, self.lighting.wall_glow)
        self._unlit = self.lighting.ambient * paint + glow[..., None]
        normal = np.where(on_table[..., None], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0])
        self._lit = [
            paint * (lamp.irradiance * _facing(normal, place - self._points))[..., None]
            for lamp, place in zip(self.lighting.lamps, self._lamps, strict=True)
        ]

    def _flicker(self, t_s: float, exposure_s: float) -> float:
        """Mean strength of the lamps over one exposure, 1 + depth sin(2 pi f t) averaged in closed form."""
        f = self.lighting.flicker_hz
        if f == 0 or self.lighting.flicker_depth == 0:
            return 1.0
        mean = float(np.sinc(f * exposure_s)) * math.sin(2 * math.pi * f * t_s)
        return 1.0 + self.lighting.flicker_depth * mean

    def _tile(self, shot: Exposure, tile: Region) -> Array:
        window = (slice(tile.top, tile.bottom), slice(tile.left, tile.right))
        light = self._unlit[window].copy()
        points = self._points[window].reshape(-1, 3)
        for lamp, lit in zip(self._lamps, self._lit, strict=True):
            seen = _visible(points, lamp - points, shot.bodies).reshape(light.shape[:2])
            light += shot.strength * seen[..., None] * lit[window]
        inside = [(body, mark, mark.box.within(tile)) for body, mark in zip(shot.bodies, shot.footprints, strict=True)]
        near = [(body, mark, box) for body, mark, box in inside if not box.empty]
        if not near:
            return np.asarray(light)
        union = Region(
            min(box.left for _, _, box in near),
            min(box.top for _, _, box in near),
            max(box.right for _, _, box in near),
            max(box.bottom for _, _, box in near),
        )
        behind = light[union.top - tile.top : union.bottom - tile.top, union.left - tile.left : union.right - tile.left]
        unseen = np.full((behind.shape[0] * behind.shape[1], 16), np.inf)
        samples = _Samples(unseen, np.repeat(behind.reshape(-1, 1, 3), 16, axis=1))
        for body, mark, _ in near:
            chosen = mark.pixels(union)
            if len(chosen):
                self._paint(body, shot, union, chosen, samples)
        behind[...] = samples.colour.mean(axis=1).reshape(behind.shape)
        return np.asarray(light)

    def _paint(self, body: Body, shot: Exposure, part: Region, chosen: NDArray[np.intp], samples: _Samples) -> None:
        """Enter ``body``'s hits in the ``chosen`` pixels of ``part`` into ``samples``."""
        window = (slice(part.top, part.bottom), slice(part.left, part.right))
        centre = self._rays[window].reshape(-1, 3)[chosen, None]
        by_column = self._by_column[window].reshape(-1, 3)[chosen, None]
        by_row = self._by_row[window].reshape(-1, 3)[chosen, None]
        rays = (centre + by_column * self._right[:, None] + by_row * self._down[:, None]).reshape(-1, 3)
        moved = self.model.position_in_world_m - np.outer(self._moment * shot.duration_s, body.velocity_m_s)
        origins = np.tile(moved, (len(chosen), 1))
        hits = body.shape.hit(origins, rays)
        nearer = np.flatnonzero(hits.t < samples.depth[chosen].reshape(-1))
        if not len(nearer):
            return
        t, normals = hits.t[nearer], hits.normals[nearer]
        points = origins[nearer] + t[:, None] * rays[nearer]
        place = chosen[nearer // 16], nearer % 16
        samples.depth[place] = t
        samples.colour[place] = self._shade(body, shot, normals, points)

    def _shade(self, body: Body, shot: Exposure, normals: Array, points: Array) -> Array:
        irradiance = np.full(len(points), self.lighting.ambient)
        others = [other for other in shot.bodies if other is not body or not _convex(body.shape)]
        above = points + LIFT_M * normals
        for lamp, place in zip(self.lighting.lamps, self._lamps, strict=True):
            facing = shot.strength * lamp.irradiance * _facing(normals, place - points)
            lit = np.flatnonzero(facing > 0)
            irradiance[lit] += facing[lit] * _visible(above[lit], place - above[lit], others)
        return np.asarray(irradiance[:, None] * np.array(body.shape.rgb))

    def _footprint(self, body: Body, exposure_s: float) -> Footprint:
        """Pixels that ``body`` may touch during the exposure: none behind the camera, all close before it."""
        points, radius = body.shape.hull
        depths = self.model.depth_m(points)
        reach = radius + float(np.linalg.norm(body.velocity_m_s)) * exposure_s / 2
        nowhere = np.zeros(2)
        if depths.max() <= -reach:
            return Footprint(Region(0, 0, 0, 0), nowhere, nowhere, 0.0)
        if depths.min() <= reach + 0.01:
            return Footprint(self._all, nowhere, nowhere, np.inf)
        half = float(self.model.focal_px.max()) * reach / (depths.min() - reach) * 1.15 + 2
        pixels = self.model.project(points)
        low, high = np.floor(pixels.min(axis=0) - half).astype(int), np.ceil(pixels.max(axis=0) + half).astype(int) + 1
        bend = 0.02 * float(np.linalg.norm(pixels[-1] - pixels[0]))  # distortion bends straight lines
        box = Region(int(low[0]), int(low[1]), int(high[0]), int(high[1]))
        return Footprint(box, pixels[0], pixels[-1], half + bend)


@dataclass(frozen=True)
class _Samples:
    """Buffers of n pixels with 16 samples: ``depth`` (n, 16) and ``colour`` (n, 16, 3), filled in place."""

    depth: Array
    colour: Array


def _convex(shape: Shape) -> bool:
    return not hasattr(shape, "depth_m")


def _facing(normals: Array, towards: Array) -> Array:
    """Lambert's cosine between unit ``normals`` and ``towards``, zero from behind."""
    cosine = np.einsum("...i,...i->...", normals, towards) / np.linalg.norm(towards, axis=-1)
    return np.asarray(np.maximum(cosine, 0.0))


def _visible(points: Array, towards: Array, bodies: Sequence[Body]) -> Array:
    """1 where the way from ``points`` (n, 3) along ``towards`` (n, 3) is free, else 0."""
    free = np.ones(len(points))
    if not len(points):
        return free
    length2 = np.einsum("ij,ij->i", towards, towards)
    middle = points.mean(axis=0)
    spread = float(np.sqrt(np.einsum("ij,ij->i", points - middle, points - middle).max()))
    way = points[0] + towards[0] - middle
    for body in bodies:
        if not body.shadow:
            continue
        center, radius = body.shape.bounds
        part = float(np.clip((center - middle) @ way / (way @ way), 0.0, 1.0))
        if np.linalg.norm(center - middle - part * way) > radius + spread:
            continue  # too far from every way of this patch of points
        apart = center - points
        along = np.einsum("ij,ij->i", apart, towards)
        off2 = np.einsum("ij,ij->i", apart, apart) - along * along / length2
        near = np.flatnonzero((off2 < radius**2) & (along > -radius * np.sqrt(length2)) & (free > 0))
        if len(near):
            free[near] = ~(body.shape.hit(points[near], towards[near]).t < 1.0)
    return free


def segments(points_m: Array, velocities_m_s: Array, radius_m: float, rgb: tuple[float, float, float]) -> list[Body]:
    """A chain (k, 3) as k - 1 capsules, each moving with its middle; a thin chain (a rope) throws no shadow."""
    return [
        Body(
            Capsule(points_m[i], points_m[i + 1], radius_m, rgb),
            velocities_m_s[i : i + 2].mean(axis=0),
            radius_m > 0.005,
        )
        for i in range(len(points_m) - 1)
    ]
