"""Images of moving bodies by ray casting: lens distortion, Lambert shading, shadows, motion blur, rolling shutter."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.motion.rotation import exp_of
from kendama_cli.rendering import kernel_light, kernel_marks, kernel_shapes
from kendama_cli.rendering.background import Background, Floor, background
from kendama_cli.rendering.kernel_shapes import BALL, CUP, PIECES, ROPE, Sizes
from kendama_cli.rendering.moving import Moving, Part, Shot
from kendama_cli.rendering.tiles import Tiles
from kendama_cli.rendering.tracer import Listed, Met, Tracer
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import AppearanceSettings, LightingSettings
from kendama_cli.settings.game import GameSettings, HandleTie
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region, whole

MOMENTS = np.array([[15, 2, 1, 12], [4, 9, 10, 7], [8, 5, 6, 11], [3, 14, 13, 0]])
"""Order in time of a pixel's 4 x 4 samples: Duerer's magic square, so that time correlates with neither direction."""
ORDER = np.array([1, 0, 2, 3, 7, 4, 5, 6, 8, 9, 10, 11, 14, 12, 13, 15])
"""The samples as a kernel counts them: every fourth alone is one of each row, column and quarter of the exposure."""


@dataclass(frozen=True)
class Samples:
    """Rays (n,) of the pixels that see more than the background, tile by tile as ``listed``, and what they meet.

    ``weight`` is a sample's part of its pixel, ``near`` the bits of the bodies that it may meet, ``fresh`` True if its
    ray is still to be traced; ``owner`` and the rest are as the kernels name them.
    """

    listed: Listed
    pixel: NDArray[np.int64]
    weight: Array
    direction: Array
    tau: Array
    near: NDArray[np.int64]
    owner: NDArray[np.int32]
    depth: Array
    triangle: NDArray[np.int32]
    fresh: NDArray[np.uint8]


class Sight:
    """One camera's pixels; outside of the tiles ``shown`` last they show the background alone.

    A pixel near ball or rope takes 16 samples, spread over its area and its exposure, one near the cup or at a mesh's
    edge four (16 where the edge sweeps over more than two), and one inside a mesh a single one: ``level`` (h, w).
    """

    def __init__(self, model: CameraModel, rays: Array, tiles: Tiles, tracer: Tracer, sizes: Sizes) -> None:
        self._model, self._rays, self._tiles, self._tracer, self._sizes = model, rays, tiles, tracer, sizes
        self._origin = np.array(model.position_in_world_m, dtype=np.float64)
        position = np.column_stack([ORDER % 4 - 1.5, ORDER // 4 - 1.5]) / 4
        self._pattern = np.column_stack([position, (MOMENTS.ravel()[ORDER] + 0.5) / 16 - 0.5])
        size = rays.shape[:2]
        self.shown = np.empty(0, dtype=np.int64)
        self.level, self._bits = np.zeros(size, dtype=np.int8), np.zeros(size, dtype=np.int64)
        self._owner, self._triangle = np.full(size, kernel_marks.NOTHING, np.int32), np.empty(size, dtype=np.int32)
        self._depth = np.full(size, np.inf)

    def blur_px(self, part: Part, shot: Shot) -> int:
        """Return the pixels to either side of a mesh's border at mid-exposure that the border sweeps or divides."""
        depth_m = float(self._model.depth_m(part.centre_m[None])[0]) - part.reach_m
        swept_m = part.travel_m * shot.spread_tau / (len(shot.moving.ball_m) - 1)
        return 1 + math.ceil(float(self._model.focal_px.max()) * swept_m / max(depth_m, 0.1) / 2)

    def look(self, shot: Shot, window: Region, blur: int) -> None:
        """Cast one ray per pixel of ``window`` at the meshes, and count the samples that each pixel needs."""
        kernel_marks.forget(self.shown, self.level, self._bits, self._owner, self._depth)
        rays, corners, shown = self._rays, window.corners, []
        if shot.moving.parts:
            met = Met(self._depth.reshape(-1), self._owner.reshape(-1), self._triangle.reshape(-1))
            seen = self._tracer.look(shot.moving.parts, window, rays, self._origin, row_tau=shot.row_tau, met=met)
            shown.append(self._tiles.about(seen, blur + 1))
            samples = kernel_marks.EDGE if blur <= 2 else kernel_marks.ALL
            kernel_marks.mark_edges(shown[0], corners, self._owner, self._depth, blur, samples, self.level)
        tiles, spread = self._tiles.inside(window), 1.0 / self._model.optics.coarsest_px
        for bit, a_m, b_m, reach_m in body_paths(shot.moving, self._sizes):
            center, half = (a_m + b_m) / 2, float(np.linalg.norm(b_m - a_m)) / 2
            near = self._tiles.showing(tiles, center, half + reach_m)
            shown.append(near)
            samples = kernel_marks.EDGE if bit == CUP else kernel_marks.ALL
            kernel_marks.mark_near(
                near, corners, rays, self._origin, a_m, b_m, reach_m, spread, bit, samples, self.level, self._bits
            )
        self.shown = np.unique(np.concatenate(shown))

    def samples(self, shot: Shot, region: Region) -> Samples:
        """Return the rays of pixels of ``region`` that show more than the background, and the meshes they meet."""
        corners = region.corners
        listed = Listed(self.shown, np.empty(len(self.shown) + 1, dtype=np.int64))
        kernel_light.count_samples(listed.tiles, corners, self.level, self._owner, listed.first)
        n = int(listed.first[-1])
        made = Samples(
            listed=listed,
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
            listed.tiles, corners, self._rays, self.level, self._bits, self._owner, self._depth,
            self._triangle, shot.row_tau, shot.spread_tau, self._pattern, made.pixel, made.weight, made.direction,
            made.tau, made.near, made.owner, made.depth, made.triangle, made.fresh,
        )  # fmt: skip
        met = Met(made.depth, made.owner, made.triangle)
        self._tracer.trace(
            shot.moving.parts, self._origin, made.direction, listed=listed, tau=made.tau, active=made.fresh, met=met
        )
        return made


def body_paths(moving: Moving, sizes: Sizes) -> Iterator[tuple[int, Array, Array, float]]:
    """Yield ball, cup and the rope's pieces: bit, path (a, b) of a sphere that holds it, the sphere's radius [m]."""
    yield BALL, moving.ball_m[0], moving.ball_m[-1], sizes.ball_m + _bend_m(moving.ball_m)
    half = (sizes.cup_floor_m + sizes.cup_depth_m) / 2
    center, reach = moving.cup_m + moving.cup_rotation[:, :, 2] * half, math.hypot(sizes.cup_outer_m, half)
    yield CUP, center[0], center[-1], reach + _bend_m(center)
    for piece in range(moving.rope_m.shape[1] - 1):
        ends = moving.rope_m[:, piece : piece + 2]
        a, b = ends.mean(axis=0)
        swept = float(np.linalg.norm(ends - np.array([a, b]), axis=2).max())
        yield ROPE + piece % PIECES, a, b, sizes.rope_m + swept


def _bend_m(positions: Array) -> float:
    """Return the largest deviation of positions (k, 3) from the segment between the first and the last."""
    straight = positions[0] + np.linspace(0, 1, len(positions))[:, None] * (positions[-1] - positions[0])
    return float(np.linalg.norm(positions - straight, axis=1).max())


SPIN_AXIS = np.array([0.48, 0.6, 0.64])
"""Axis of a patterned ball's rotation, which is oblique to all axes of the world."""
LIFT_M = 1e-4
"""Shadow rays start this far above a mesh: single precision knows a link's surface to some micrometres."""


class Raycaster:
    """One camera's view of bodies before a background; light is linear, reflectance times irradiance in red green blue.

    The background is seen at mid-exposure; it is a wall and a table, or what stands ``behind`` instead.
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
            self._background, self._tiles = behind, Tiles(behind.rays, behind.points, behind.lit, self._origin)
        self._tracer = Tracer(self._tiles, model.height_px, model.width_px)
        self._lamps = [(np.array(lamp.position_m, dtype=np.float64), lamp.irradiance) for lamp in lighting.lamps]
        cup = game.cup
        handle_m = cup.tie.radius_m if isinstance(cup.tie, HandleTie) else 0.0
        own = cup.radius_m, cup.outer_radius_m, cup.depth_m, cup.wall_m, cup.floor_m, handle_m
        self._sizes = Sizes(game.ball.radius_m, *own, appearance.rope_radius_m)
        self._spin = 2 * np.pi * appearance.ball_spin_hz * SPIN_AXIS
        self._pattern_of_ball = ("plain", "two_tone", "striped", "wooden").index(appearance.ball_pattern)
        self._sight = Sight(model, self._background.rays, self._tiles, self._tracer, self._sizes)
        self._free = np.ones((len(self._lamps), model.height_px, model.width_px), dtype=np.uint8)
        self._everywhere = whole(model.width_px, model.height_px)
        self._kept, self._stale, self._strength = np.empty(0), np.empty(0, dtype=np.int64), np.empty(0)

    def render(self, shot: Shot, region: Region) -> Array:
        """Render the mean light (h, w, 3) in ``region``, which must lie in the image."""
        light = np.empty((region.bottom - region.top, region.right - region.left, 3))
        self._render(shot, region, self._tiles.inside(region), light)
        return light

    def renew(self, shot: Shot) -> tuple[Array, NDArray[np.int64]]:
        """Render the mean light (h, w, 3) in the image, and the tiles in which it may differ from the last time.

        Only these are rendered, into the array that was given before.
        """
        before = self._stale
        if not np.array_equal(shot.strength, self._strength):
            self._kept, self._strength = np.empty((*self._free.shape[1:], 3)), shot.strength
            before = self._tiles.inside(self._everywhere)
        self._stale = self._render(shot, self._everywhere, before, self._kept)
        return self._kept, np.union1d(before, self._stale)

    def _render(self, shot: Shot, region: Region, tiles: NDArray[np.int64], light: Array) -> NDArray[np.int64]:
        """Render ``tiles`` and those with a body or a shadow, which are returned, into ``light`` of ``region``."""
        blur = max((self._sight.blur_px(part, shot) for part in shot.moving.parts), default=0)
        grown = Region(region.left - blur, region.top - blur, region.right + blur, region.bottom + blur)
        self._sight.look(shot, grown.within(self._everywhere), blur)
        samples = self._sight.samples(shot, region)
        irradiance, normals = self._irradiance(shot, samples)
        self._darken_background(shot.moving, shot.row_tau, region)
        found = self._concerned(region)
        background, look, corners = self._background, self._appearance, region.corners
        kernel_light.background_light(
            np.union1d(tiles, found), corners, background.unlit, background.lit, self._free, shot.strength, light
        )
        if self._pattern_of_ball:
            kernel_light.paint_ball(samples.owner, normals, exp_of(shot.t_s * self._spin), self._pattern_of_ball)
        paints = [*(part.surface.rgb for part in shot.moving.parts), look.ball_second_rgb]
        paints += [look.rope_rgb, look.cup_rgb, look.ball_rgb]
        kernel_light.collect(
            samples.pixel, samples.weight, samples.owner, irradiance, np.array(paints), self._sight.level, corners,
            light,
        )  # fmt: skip
        return found

    def _irradiance(self, shot: Shot, samples: Samples) -> tuple[Array, Array]:
        """Return the light (n,) on the surface that each sample meets, and the normal (n, 3) there."""
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
            self._tracer.darken(moving.parts, starts, lamp, listed=samples.listed, tau=tau, owner=owner, free=free)
            kernel_light.add_light(free, strength, cosine, brightness, irradiance)
        return irradiance, normals

    def _darken_background(self, moving: Moving, row_tau: Array, region: Region) -> None:
        """Find the points of the background that each lamp reaches."""
        tiles = self._tiles.lit_inside(region)
        bodies = [path for path in body_paths(moving, self._sizes) if path[0] < ROPE]
        for free, (lamp, _) in zip(self._free, self._lamps, strict=True):
            free[region.top : region.bottom, region.left : region.right] = 1
            for _, a_m, b_m, reach_m in bodies:
                center, half = (a_m + b_m) / 2, float(np.linalg.norm(b_m - a_m)) / 2
                near = self._tiles.shaded(tiles, center, half + reach_m, lamp)
                pixel = kernel_marks.pixels_of(near, region.corners, self._model.width_px)
                start, still = self._background.points.reshape(-1, 3)[pixel], free.reshape(-1)[pixel]
                kernel_shapes.shade(
                    start, lamp, row_tau[pixel // self._model.width_px], moving.ball_m, moving.cup_m,
                    moving.cup_rotation, self._sizes, np.full(len(pixel), kernel_marks.NOTHING, dtype=np.int32), still,
                )  # fmt: skip
                free.reshape(-1)[pixel] = still
            self._tracer.darken_background(
                moving.parts, region, self._background.points, lamp, row_tau=row_tau, free=free
            )

    def _concerned(self, region: Region) -> NDArray[np.int64]:
        """Return the tiles of ``region`` in which a body may be seen or a shadow falls on the background."""
        found = np.zeros(self._tiles.count, dtype=np.bool_)
        found[self._sight.shown] = True
        kernel_light.shadowed(self._tiles.lit_inside(region), self._free, found)
        return np.flatnonzero(found)
