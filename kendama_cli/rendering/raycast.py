"""Images of moving bodies by ray casting: lens distortion, Lambert shading, shadows, motion blur, rolling shutter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kendama_cli.motion.rotation import exp_of
from kendama_cli.rendering import kernel_light, kernel_marks, kernel_shapes
from kendama_cli.rendering.background import Background, background
from kendama_cli.rendering.floor import Floor
from kendama_cli.rendering.kernel_shapes import ROPE, Sizes
from kendama_cli.rendering.moving import Moving, Shot
from kendama_cli.rendering.sight import Samples, Sight, ways
from kendama_cli.rendering.tiles import Tiles
from kendama_cli.rendering.tracer import Tracer
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import AppearanceSettings, LightingSettings
from kendama_cli.settings.game import GameSettings, HandleTie
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region, whole

SPIN_AXIS = np.array([0.48, 0.6, 0.64])
"""A patterned ball turns about this, which is oblique to all axes of the world."""
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
        background, look, corners = self._background, self._appearance, _corners(region)
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
        bodies = [way for way in ways(moving, self._sizes) if way[0] < ROPE]
        for free, (lamp, _) in zip(self._free, self._lamps, strict=True):
            free[region.top : region.bottom, region.left : region.right] = 1
            for _, a_m, b_m, reach_m in bodies:
                middle, half = (a_m + b_m) / 2, float(np.linalg.norm(b_m - a_m)) / 2
                near = self._tiles.shaded(tiles, middle, half + reach_m, lamp)
                pixel = kernel_marks.pixels_of(near, _corners(region), self._model.width_px)
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


def _corners(region: Region) -> NDArray[np.int64]:
    return np.array([region.left, region.top, region.right, region.bottom], dtype=np.int64)
