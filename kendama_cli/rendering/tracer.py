"""Tracing many rays through moving meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.rendering import kernel_rays
from kendama_cli.rendering.moving import Part
from kendama_cli.rendering.tiles import Tiles, bundles_meeting
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.region import Region


@dataclass(frozen=True)
class Met:
    """First hits of n rays, filled in place: distance, number of the part or -1, and its triangle."""

    depth: Array
    owner: NDArray[np.int32]
    triangle: NDArray[np.int32]


@dataclass(frozen=True)
class Listed:
    """Rays in the order of their tiles: those of ``tiles[k]`` stand from ``first[k]`` to ``first[k + 1]``."""

    tiles: NDArray[np.int64]
    first: NDArray[np.int64]


class Tracer:
    """Tests rays against the meshes that they may meet, the nearest mesh first, so that those behind it are skipped.

    It reuses the buffers of the rays from frame to frame.
    ``tau`` and ``row_tau`` are the rays' own times, as in the kernels.
    """

    def __init__(self, tiles: Tiles, height_px: int, width_px: int) -> None:
        self._tiles = tiles
        self._index = np.empty(0, dtype=np.int64)
        self._origins = self._directions = np.empty((0, 3), dtype=np.float32)
        self._reserve(height_px * width_px)

    def look(
        self, parts: Sequence[Part], window: Region, rays: Array, origin: Array, *, row_tau: Array, met: Met
    ) -> NDArray[np.int64]:
        """Enter into ``met``, flat over the image, what the centre of each pixel of ``window`` shows.

        Returns the tiles in which a part can be seen.
        """
        tiles, far = self._tiles.inside(window), met.depth.reshape(rays.shape[:2])
        seen = np.zeros(len(tiles), dtype=np.bool_)
        for number, part in _nearest_first(parts, origin):
            may = self._tiles.showing_part(tiles, part)
            seen |= may
            count = kernel_rays.pixels_into_mesh(
                tiles[may], window.corners, rays, origin, False, row_tau, far, part.centre_m, part.reach_m,
                part.into, part.surface.low, part.surface.high, self._index, self._origins, self._directions,
            )  # fmt: skip
            self._take(part, number, count, met)
        return tiles[seen]

    def trace(
        self,
        parts: Sequence[Part],
        origin: Array,
        directions: Array,
        *,
        listed: Listed,
        tau: Array,
        active: NDArray[np.uint8],
        met: Met,
    ) -> None:
        """Enter into ``met`` what the active rays (n, 3) from ``origin`` meet."""
        self._reserve(len(tau))
        ends = origin + directions
        for number, part in _nearest_first(parts, origin):
            near = np.flatnonzero(self._tiles.showing_part(listed.tiles, part))
            count = kernel_rays.rays_into_mesh(
                near, listed.first, origin[None], ends, tau, active, met.depth, part.centre_m, part.reach_m, part.into,
                part.surface.low, part.surface.high, self._index, self._origins, self._directions,
            )  # fmt: skip
            self._take(part, number, count, met)

    def darken(
        self,
        parts: Sequence[Part],
        starts: Array,
        lamp: Array,
        *,
        listed: Listed,
        tau: Array,
        owner: NDArray[np.int32],
        free: NDArray[np.uint8],
    ) -> None:
        """Set ``free`` (n,) to 0 where a mesh stands between ``starts`` (n, 3), on their owners, and ``lamp``."""
        self._reserve(len(tau))
        center, reach = np.empty((len(listed.tiles), 3)), np.empty(len(listed.tiles))
        kernel_rays.bound_starts(listed.first, free, starts, center, reach)
        lit = np.flatnonzero(reach >= 0)
        center, reach = center[lit], reach[lit]
        for number, part in enumerate(parts):
            near = lit[bundles_meeting(part, center, lamp - center, 1.0, reach)]
            active = free * (owner != number) if part.surface.convex else free  # a rod never shades itself
            count = kernel_rays.rays_into_mesh(
                near, listed.first, starts, lamp[None], tau, active, active, part.centre_m, part.reach_m, part.into,
                part.surface.low, part.surface.high, self._index, self._origins, self._directions,
            )  # fmt: skip
            self._block(part, count, free)

    def darken_background(
        self,
        parts: Sequence[Part],
        region: Region,
        points: Array,
        lamp: Array,
        *,
        row_tau: Array,
        free: NDArray[np.uint8],
    ) -> None:
        """Set ``free`` (h, w) to 0 where a mesh stands between the background's ``points`` (h, w, 3) and ``lamp``."""
        tiles = self._tiles.lit_inside(region)
        for part in parts:
            near = tiles[self._tiles.shaded_by_part(tiles, part, lamp)]
            count = kernel_rays.pixels_into_mesh(
                near, region.corners, points, lamp, True, row_tau, free, part.centre_m, part.reach_m,
                part.into, part.surface.low, part.surface.high, self._index, self._origins, self._directions,
            )  # fmt: skip
            self._block(part, count, free.reshape(-1))

    def _take(self, part: Part, number: int, count: int, met: Met) -> None:
        if count:
            index, origins, directions = self._index[:count], self._origins[:count], self._directions[:count]
            surface = part.surface
            hits = surface.first(origins, directions)
            kernel_rays.take_nearer(
                index, hits, origins, directions, surface.anchors, surface.normals, number, met.depth, met.owner,
                met.triangle,
            )  # fmt: skip

    def _block(self, part: Part, count: int, free: NDArray[np.uint8]) -> None:
        if count:
            hits = part.surface.blocked(self._origins[:count], self._directions[:count])
            kernel_rays.mark_blocked(self._index[:count], hits, free)

    def _reserve(self, count: int) -> None:
        if len(self._index) < count:
            self._index = np.empty(count, dtype=np.int64)
            self._origins, self._directions = np.empty((2, count, 3), dtype=np.float32)


def _nearest_first(parts: Sequence[Part], origin: Array) -> list[tuple[int, Part]]:
    return sorted(enumerate(parts), key=lambda one: float(np.linalg.norm(one[1].centre_m - origin)))
