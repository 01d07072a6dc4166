"""Content of each pixel of a camera, and the number of rays that it takes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.rendering import kernel_light, kernel_marks
from kendama_cli.rendering.kernel_shapes import BALL, CUP, PIECES, ROPE, Sizes
from kendama_cli.rendering.moving import Moving, Part, Shot
from kendama_cli.rendering.tiles import Tiles
from kendama_cli.rendering.tracer import Listed, Met, Tracer
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region

MOMENTS = np.array([[15, 2, 1, 12], [4, 9, 10, 7], [8, 5, 6, 11], [3, 14, 13, 0]])
"""Order in time of a pixel's 4 x 4 samples: Duerer's magic square, so that time correlates with neither direction."""
ORDER = np.array([1, 0, 2, 3, 7, 4, 5, 6, 8, 9, 10, 11, 14, 12, 13, 15])
"""The samples as a kernel counts them: every fourth alone is one of each row, column and quarter of the exposure."""


@dataclass(frozen=True)
class Samples:
    """Rays (n,) of the pixels that see more than the background, tile by tile as ``listed``, and what they meet.

    ``weight`` is a sample's part of its pixel, ``near`` the bits of the bodies that it may meet, ``fresh`` whether its
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
        place = np.column_stack([ORDER % 4 - 1.5, ORDER // 4 - 1.5]) / 4
        self._pattern = np.column_stack([place, (MOMENTS.ravel()[ORDER] + 0.5) / 16 - 0.5])
        size = rays.shape[:2]
        self.shown = np.empty(0, dtype=np.int64)
        self.level, self._bits = np.zeros(size, dtype=np.int8), np.zeros(size, dtype=np.int64)
        self._owner, self._triangle = np.full(size, kernel_marks.NOTHING, np.int32), np.empty(size, dtype=np.int32)
        self._depth = np.full(size, np.inf)

    def blur_px(self, part: Part, shot: Shot) -> int:
        """Return the pixels to either side of a mesh's border at mid-exposure that the border sweeps or shares."""
        depth_m = float(self._model.depth_m(part.centre_m[None])[0]) - part.reach_m
        swept_m = part.travel_m * shot.spread_tau / (len(shot.moving.ball_m) - 1)
        return 1 + math.ceil(float(self._model.focal_px.max()) * swept_m / max(depth_m, 0.1) / 2)

    def look(self, shot: Shot, window: Region, blur: int) -> None:
        """Cast one ray per pixel of ``window`` at the meshes, and count the samples that each pixel needs."""
        kernel_marks.forget(self.shown, self.level, self._bits, self._owner, self._depth)
        rays, corners, shown = self._rays, _corners(window), []
        if shot.moving.parts:
            met = Met(self._depth.reshape(-1), self._owner.reshape(-1), self._triangle.reshape(-1))
            seen = self._tracer.look(shot.moving.parts, window, rays, self._origin, row_tau=shot.row_tau, met=met)
            shown.append(self._tiles.about(seen, blur + 1))
            samples = kernel_marks.EDGE if blur <= 2 else kernel_marks.ALL
            kernel_marks.mark_edges(shown[0], corners, self._owner, self._depth, blur, samples, self.level)
        tiles, spread = self._tiles.inside(window), 1.0 / self._model.optics.coarsest_px
        for bit, a_m, b_m, reach_m in ways(shot.moving, self._sizes):
            middle, half = (a_m + b_m) / 2, float(np.linalg.norm(b_m - a_m)) / 2
            near = self._tiles.showing(tiles, middle, half + reach_m)
            shown.append(near)
            samples = kernel_marks.EDGE if bit == CUP else kernel_marks.ALL
            kernel_marks.mark_near(
                near, corners, rays, self._origin, a_m, b_m, reach_m, spread, bit, samples, self.level, self._bits
            )
        self.shown = np.unique(np.concatenate(shown))

    def samples(self, shot: Shot, region: Region) -> Samples:
        """Return the rays of pixels of ``region`` that show more than the background, and the meshes they meet."""
        corners = _corners(region)
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
            shot.moving.parts, self._origin, made.direction, listed=listed, tau=made.tau, wanted=made.fresh, met=met
        )
        return made


def ways(moving: Moving, sizes: Sizes) -> Iterator[tuple[int, Array, Array, float]]:
    """Yield ball, cup and the rope's pieces: bit, path (a, b) of a sphere that holds it, the sphere's radius [m]."""
    yield BALL, moving.ball_m[0], moving.ball_m[-1], sizes.ball_m + _bend_m(moving.ball_m)
    half = (sizes.cup_floor_m + sizes.cup_depth_m) / 2
    middle, reach = moving.cup_m + moving.cup_rotation[:, :, 2] * half, math.hypot(sizes.cup_outer_m, half)
    yield CUP, middle[0], middle[-1], reach + _bend_m(middle)
    for piece in range(moving.rope_m.shape[1] - 1):
        ends = moving.rope_m[:, piece : piece + 2]
        a, b = ends.mean(axis=0)
        swept = float(np.linalg.norm(ends - np.array([a, b]), axis=2).max())
        yield ROPE + piece % PIECES, a, b, sizes.rope_m + swept


def _bend_m(places: Array) -> float:
    """Return how far places (k, 3) stray from the straight way between the first and the last, at most."""
    straight = places[0] + np.linspace(0, 1, len(places))[:, None] * (places[-1] - places[0])
    return float(np.linalg.norm(places - straight, axis=1).max())


def _corners(region: Region) -> NDArray[np.int64]:
    return np.array([region.left, region.top, region.right, region.bottom], dtype=np.int64)
