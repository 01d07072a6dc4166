"""Images of moving bodies by ray casting: lens distortion, Lambert shading, shadows, motion blur, rolling shutter."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.motion.rotation_matrix import exp_of
from kendama_cli.rendering import kernel_light, kernel_rays, kernel_shapes
from kendama_cli.rendering.background import Background, background
from kendama_cli.rendering.floor import Floor
from kendama_cli.rendering.kernel_shapes import BALL, CUP, PIECES, ROPE, Sizes
from kendama_cli.rendering.moving import Moving, Part
from kendama_cli.rendering.tiles import Tiles
from kendama_cli.rendering.tracer import Met, Tracer
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import AppearanceSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.region import Region, whole

MOMENTS = np.array([[15, 2, 1, 12], [4, 9, 10, 7], [8, 5, 6, 11], [3, 14, 13, 0]])
"""Order in time of a pixel's 4 x 4 samples: Duerer's magic square, so that time correlates with neither direction."""
ORDER = np.array([1, 0, 2, 3, 7, 4, 5, 6, 8, 9, 10, 11, 14, 12, 13, 15])
"""The samples as a kernel counts them: every fourth alone is one of each row, column and quarter of the exposure."""
SPIN_AXIS = np.array([0.48, 0.6, 0.64])
"""A patterned ball turns about this, which is oblique to all axes of the world."""
LIFT_M = 1e-4
"""Shadow rays start this far above a mesh: single precision knows a link's surface to some micrometres."""


@dataclass(frozen=True)
class Shot:
    """What one frame is taken of: the bodies, when each row is exposed, and how strong the lamps are then.

    ``row_tau`` (h,) is each row's mid-exposure in [0, k - 1] of the k moments of ``moving``, ``spread_tau`` the
    exposure on that scale, ``strength`` (h,) the lamps' mean strength over each row's exposure. A patterned ball has
    turned since time 0 until ``t_s``.
    """

    t_s: float
    moving: Moving
    row_tau: Array
    spread_tau: float
    strength: Array


@dataclass(frozen=True)
class _Samples:
    """Rays (n,) of the pixels that see more than the background, tile by tile, and what they meet.

    ``weight`` is a sample's part of its pixel, ``near`` the bits of the bodies that it may meet, ``fresh`` whether its
    ray is still to be traced; ``owner`` and the rest are as the kernels name them.
    """

    pixel: NDArray[np.int64]
    weight: Array
    direction: Array
    tau: Array
    near: NDArray[np.int64]
    owner: NDArray[np.int32]
    depth: Array
    triangle: NDArray[np.int32]
    fresh: NDArray[np.uint8]


class Raycaster:
    """One camera's view of bodies before a background; light is linear, reflectance times irradiance in red green blue.

    A pixel near ball or rope takes 16 samples, spread over its area and its exposure, one near the cup or at a mesh's
    edge four (16 where the edge sweeps over more than two), and one inside a mesh a single one. The background: one, at
    mid-exposure; it is a wall and a table, or what stands ``behind`` instead.
    """

    def __init__(
        self,
        model: CameraModel,
        appearance: AppearanceSettings,
        lighting: LightingSettings,
        game: GameSettings,
        behind: Background | Floor | None = None,
    ) -> None:
        self._model, self._appearance, self._ambient = model, appearance, lighting.ambient
        self._origin = np.array(model.position_in_world_m, dtype=np.float64)
        self._background: Background | Floor
        if behind is None:
            self._background, self._tiles = background(model, appearance, lighting)
        else:
            self._background, self._tiles = behind, Tiles(behind.rays, behind.points, self._origin)
        self._tracer = Tracer(self._tiles, model.height_px, model.width_px)
        self._lamps = [(np.array(lamp.position_m, dtype=np.float64), lamp.irradiance) for lamp in lighting.lamps]
        cup = game.cup
        outer = cup.radius_m + cup.wall_m
        self._sizes = Sizes(game.ball.radius_m, cup.radius_m, outer, cup.depth_m, cup.wall_m, appearance.rope_radius_m)
        place = np.column_stack([ORDER % 4 - 1.5, ORDER // 4 - 1.5]) / 4
        self._pattern = np.column_stack([place, (MOMENTS.ravel()[ORDER] + 0.5) / 16 - 0.5])
        size = (model.height_px, model.width_px)
        self._spin = 2 * np.pi * appearance.ball_spin_hz * SPIN_AXIS
        self._pattern_of_ball = ("plain", "two_tone", "striped", "wooden").index(appearance.ball_pattern)
        self._level, self._bits = np.zeros(size, dtype=np.int8), np.zeros(size, dtype=np.int64)
        self._owner, self._triangle = np.empty(size, dtype=np.int32), np.empty(size, dtype=np.int32)
        self._depth, self._free = np.empty(size), np.ones((len(self._lamps), *size), dtype=np.uint8)

    def render(self, shot: Shot, region: Region) -> Array:
        """Mean light (h, w, 3) in ``region``, which must lie in the image."""
        blur = max((self._blur_px(part, shot) for part in shot.moving.parts), default=0)
        grown = Region(region.left - blur, region.top - blur, region.right + blur, region.bottom + blur)
        self._look(shot, grown.within(whole(self._model.width_px, self._model.height_px)), blur)
        samples = self._samples(shot, _corners(region))
        irradiance, normals = self._irradiance(shot, samples)
        self._darken_background(shot.moving, shot.row_tau, region)
        light = np.empty((region.bottom - region.top, region.right - region.left, 3))
        background, look, corners = self._background, self._appearance, _corners(region)
        kernel_light.background_light(corners, background.unlit, background.lit, self._free, shot.strength, light)
        if self._pattern_of_ball:
            kernel_light.paint_ball(samples.owner, normals, exp_of(shot.t_s * self._spin), self._pattern_of_ball)
        paints = [*(part.surface.rgb for part in shot.moving.parts), look.ball_second_rgb]
        paints += [look.rope_rgb, look.cup_rgb, look.ball_rgb]
        kernel_light.collect(
            samples.pixel, samples.weight, samples.owner, irradiance, np.array(paints), self._level, corners, light
        )
        return light

    def _blur_px(self, part: Part, shot: Shot) -> int:
        """Pixels to either side of a mesh's border, as seen at mid-exposure, that the border sweeps or shares."""
        depth_m = float(self._model.depth_m(part.centre_m[None])[0]) - part.reach_m
        swept_m = part.travel_m * shot.spread_tau / (len(shot.moving.ball_m) - 1)
        return 1 + math.ceil(float(self._model.focal_px.max()) * swept_m / max(depth_m, 0.1) / 2)

    def _look(self, shot: Shot, window: Region, blur: int) -> None:
        """One ray per pixel of ``window`` to the meshes, and how many samples each pixel needs."""
        rows, columns = slice(window.top, window.bottom), slice(window.left, window.right)
        self._level[rows, columns], self._bits[rows, columns] = kernel_rays.SMOOTH, 0
        self._owner[rows, columns], self._depth[rows, columns] = kernel_rays.NOTHING, np.inf
        rays, corners = self._background.rays, _corners(window)
        if shot.moving.parts:
            met = Met(self._depth.reshape(-1), self._owner.reshape(-1), self._triangle.reshape(-1))
            self._tracer.look(shot.moving.parts, window, rays, self._origin, row_tau=shot.row_tau, met=met)
            samples = kernel_rays.EDGE if blur <= 2 else kernel_rays.ALL
            kernel_rays.mark_edges(corners, self._owner, self._depth, blur, samples, self._level)
        tiles, spread = self._tiles.inside(window), 1.0 / float(self._model.focal_px.min())
        for bit, a_m, b_m, reach_m in _ways(shot.moving, self._sizes):
            middle, half = (a_m + b_m) / 2, float(np.linalg.norm(b_m - a_m)) / 2
            near = self._tiles.showing(tiles, middle, half + reach_m)
            samples = kernel_rays.EDGE if bit == CUP else kernel_rays.ALL
            kernel_rays.mark_near(
                near, corners, rays, self._origin, a_m, b_m, reach_m, spread, bit, samples, self._level, self._bits
            )

    def _samples(self, shot: Shot, corners: NDArray[np.int64]) -> _Samples:
        n = kernel_light.count_samples(corners, self._level, self._owner)
        made = _Samples(
            pixel=np.empty(n, dtype=np.int64),
            weight=np.empty(n),
            direction=np.empty((n, 3)),
            tau=np.empty(n),
            near=np.empty(n, dtype=np.int64),
            owner=np.empty(n, dtype=np.int32),
            depth=np.empty(n),
            triangle=np.empty(n, dtype=np.int32),
            fresh=np.empty(n, dtype=np.uint8),
        )
        kernel_light.list_samples(
            corners, self._background.rays, self._level, self._bits, self._owner, self._depth, self._triangle,
            shot.row_tau, shot.spread_tau, self._pattern, made.pixel, made.weight, made.direction, made.tau,
            made.near, made.owner, made.depth, made.triangle, made.fresh,
        )  # fmt: skip
        met = Met(made.depth, made.owner, made.triangle)
        self._tracer.trace(shot.moving.parts, self._origin, made.direction, tau=made.tau, wanted=made.fresh, met=met)
        return made

    def _irradiance(self, shot: Shot, samples: _Samples) -> tuple[Array, Array]:
        """Light (n,) on what each sample meets, and the normal (n, 3) there."""
        moving, sizes, owner, tau = shot.moving, self._sizes, samples.owner, samples.tau
        normals, starts = np.empty((len(tau), 3)), np.empty((len(tau), 3))
        kernel_shapes.meet(
            self._origin, samples.direction, tau, samples.near, moving.ball_m, moving.cup_m, moving.cup_rotation,
            moving.rope_m, sizes, samples.depth, owner, normals,
        )  # fmt: skip
        for number, part in enumerate(moving.parts):
            kernel_light.mesh_normals(owner, samples.triangle, tau, number, part.into, part.surface.normals, normals)
        kernel_light.touch(self._origin, samples.direction, samples.depth, owner, normals, LIFT_M, starts)
        irradiance, cosine = np.full(len(tau), self._ambient), np.empty(len(tau))
        strength, free = shot.strength[samples.pixel // self._model.width_px], np.empty(len(tau), dtype=np.uint8)
        for lamp, brightness in self._lamps:
            kernel_light.face(owner, normals, starts, lamp, cosine, free)
            kernel_shapes.shade(starts, lamp, tau, moving.ball_m, moving.cup_m, moving.cup_rotation, sizes, owner, free)
            self._tracer.darken(moving.parts, starts, lamp, tau=tau, owner=owner, free=free)
            kernel_light.add_light(free, strength, cosine, brightness, irradiance)
        return irradiance, normals

    def _darken_background(self, moving: Moving, row_tau: Array, region: Region) -> None:
        """Which points of the background each lamp reaches."""
        tiles = self._tiles.inside(region)
        bodies = [way for way in _ways(moving, self._sizes) if way[0] < ROPE]
        for free, (lamp, _) in zip(self._free, self._lamps, strict=True):
            free[region.top : region.bottom, region.left : region.right] = 1
            for _, a_m, b_m, reach_m in bodies:
                middle, half = (a_m + b_m) / 2, float(np.linalg.norm(b_m - a_m)) / 2
                near = self._tiles.shaded(tiles, middle, half + reach_m, lamp)
                pixel = kernel_rays.pixels_of(near, _corners(region), self._model.width_px)
                start, still = self._background.points.reshape(-1, 3)[pixel], free.reshape(-1)[pixel]
                kernel_shapes.shade(
                    start, lamp, row_tau[pixel // self._model.width_px], moving.ball_m, moving.cup_m,
                    moving.cup_rotation, self._sizes, np.full(len(pixel), kernel_rays.NOTHING, dtype=np.int32), still,
                )  # fmt: skip
                free.reshape(-1)[pixel] = still
            self._tracer.darken_background(
                moving.parts, region, self._background.points, lamp, row_tau=row_tau, free=free
            )


def _ways(moving: Moving, sizes: Sizes) -> Iterator[tuple[int, Array, Array, float]]:
    """Ball, cup and the rope's pieces: bit, the way (a, b) of a sphere that holds it, and the sphere's radius [m]."""
    yield BALL, moving.ball_m[0], moving.ball_m[-1], sizes.ball_m + _bend_m(moving.ball_m)
    middle = moving.cup_m + moving.cup_rotation[:, :, 2] * sizes.cup_depth_m / 2
    reach = math.hypot(sizes.cup_outer_m, sizes.cup_depth_m / 2)
    yield CUP, middle[0], middle[-1], reach + _bend_m(middle)
    for piece in range(moving.rope_m.shape[1] - 1):
        ends = moving.rope_m[:, piece : piece + 2]
        a, b = ends.mean(axis=0)
        swept = float(np.linalg.norm(ends - np.array([a, b]), axis=2).max())
        yield ROPE + piece % PIECES, a, b, sizes.rope_m + swept


def _bend_m(places: Array) -> float:
    """How far places (k, 3) stray from the straight way between the first and the last, at most."""
    straight = places[0] + np.linspace(0, 1, len(places))[:, None] * (places[-1] - places[0])
    return float(np.linalg.norm(places - straight, axis=1).max())


def _corners(region: Region) -> NDArray[np.int64]:
    return np.array([region.left, region.top, region.right, region.bottom], dtype=np.int64)
