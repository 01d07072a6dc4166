"""Squares of an image, and which of them a body can concern at all."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kendama_cli.rendering.kernel_rays import TILE, bundles_into_box
from kendama_cli.rendering.moving import Part
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.region import Region


class Tiles:
    """The tiles of one camera: the cone of rays through each, and a sphere about the background's points seen in it."""

    def __init__(self, rays: Array, points: Array, origin: Array) -> None:
        height, width = rays.shape[:2]
        self._origin, self._across = origin, -(-width // TILE)
        self._down = -(-height // TILE)
        count = self._down * self._across
        self._axis, self._cosine = np.empty((count, 3)), np.empty(count)
        self._centre, self._reach = np.empty((count, 3)), np.empty(count)
        unit = rays / np.linalg.norm(rays, axis=2, keepdims=True)
        for number in range(count):
            top, left = number // self._across * TILE, number % self._across * TILE
            inside = unit[top : top + TILE, left : left + TILE].reshape(-1, 3)
            axis = inside.mean(axis=0)
            self._axis[number] = axis / np.linalg.norm(axis)
            self._cosine[number] = (inside @ self._axis[number]).min()
            seen = points[top : top + TILE, left : left + TILE].reshape(-1, 3)
            self._centre[number] = (seen.min(axis=0) + seen.max(axis=0)) / 2
            self._reach[number] = np.linalg.norm(seen - self._centre[number], axis=1).max()

    def inside(self, window: Region) -> NDArray[np.int64]:
        """Tiles that share a pixel with ``window``."""
        rows = np.arange(window.top // TILE, -(-window.bottom // TILE))
        columns = np.arange(window.left // TILE, -(-window.right // TILE))
        return np.asarray((rows[:, None] * self._across + columns).ravel(), dtype=np.int64)

    def showing(self, tiles: NDArray[np.int64], centre_m: Array, reach_m: float) -> NDArray[np.int64]:
        """Those of ``tiles`` in which a body within ``reach_m`` of ``centre_m`` can appear."""
        apart = centre_m - self._origin
        distance = float(np.linalg.norm(apart))
        if distance <= reach_m:
            return tiles
        widest = np.arccos(np.clip(self._cosine[tiles], -1, 1)) + math.asin(reach_m / distance) + 0.01  # half a pixel
        off = np.arccos(np.clip(self._axis[tiles] @ apart / distance, -1, 1))
        return np.asarray(tiles[off <= widest])

    def shaded(self, tiles: NDArray[np.int64], centre_m: Array, reach_m: float, lamp_m: Array) -> NDArray[np.int64]:
        """Those of ``tiles`` whose background a body within ``reach_m`` of ``centre_m`` can shade from ``lamp_m``."""
        start = self._centre[tiles]
        way, apart = lamp_m - start, centre_m - start
        share = np.clip((way * apart).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)
        off = np.linalg.norm(apart - share[:, None] * way, axis=1)
        return np.asarray(tiles[off <= reach_m + self._reach[tiles] + 1e-6])

    def showing_part(self, tiles: NDArray[np.int64], part: Part) -> NDArray[np.int64]:
        """Those of ``tiles`` in which the middle of a pixel can show ``part``."""
        near = self.showing(tiles, part.centre_m, part.reach_m)
        far = float(np.linalg.norm(part.centre_m - self._origin)) + part.reach_m
        widest = 2 * np.sin(np.arccos(np.clip(self._cosine[near], -1, 1)) / 2) * far
        return near[_meeting(part, self._origin[None], self._axis[near], far, widest)]

    def shaded_by_part(self, tiles: NDArray[np.int64], part: Part, lamp_m: Array) -> NDArray[np.int64]:
        """Those of ``tiles`` whose background ``part`` can shade from ``lamp_m``."""
        near = self.shaded(tiles, part.centre_m, part.reach_m, lamp_m)
        return near[_meeting(part, self._centre[near], lamp_m - self._centre[near], 1.0, self._reach[near])]


def _meeting(part: Part, starts: Array, ways: Array, far: float, widths: Array) -> NDArray[np.bool_]:
    """Which bundles of rays (n,) may meet the part's box, wherever it is meanwhile."""
    may = np.empty(len(ways), dtype=np.bool_)
    grown = widths + part.travel_m + 1e-6
    bundles_into_box(starts, ways, far, grown, part.into[0], part.surface.low, part.surface.high, may)
    return may
