"""Squares of an image, and a test of those that a body can affect."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.rendering.kernel_rays import TILE, bundles_into_box
from kendama_cli.rendering.moving import Part
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.region import Region


class Tiles:
    """The tiles of one camera: the cone of rays through each, and a sphere about the background's points seen in it.

    ``rays`` and ``points`` are (h, w, 3), ``lit`` (lamps, h, w, 3) is the light that the lamps add to the points.
    """

    def __init__(self, rays: Array, points: Array, lit: NDArray[np.float32], origin: Array) -> None:
        height, width = rays.shape[:2]
        self._origin, self._across, self._down = origin, -(-width // TILE), -(-height // TILE)
        self.count = self._down * self._across
        unit = rays / np.linalg.norm(rays, axis=2, keepdims=True)
        axis = _of_tiles(np.add, unit)
        axis /= np.linalg.norm(axis, axis=2, keepdims=True)
        cosine = np.clip(_of_tiles(np.minimum, (unit * _of_pixels(axis, height, width)).sum(axis=2)), -1, 1).ravel()
        self._axis, self._cosine, self._sine = axis.reshape(-1, 3), cosine, np.sqrt(1 - cosine**2)
        steps = [np.linalg.norm(np.diff(rays, axis=along), axis=2).max(initial=0.0) for along in (0, 1)]
        self._chord = 2 * np.sin(np.arccos(cosine) / 2) + math.hypot(*steps)  # with a pixel more on each side
        centre = (_of_tiles(np.minimum, points) + _of_tiles(np.maximum, points)) / 2
        off = np.linalg.norm(points - _of_pixels(centre, height, width), axis=2)
        self._centre, self._reach = centre.reshape(-1, 3), _of_tiles(np.maximum, off).ravel()
        self._lit = _of_tiles(np.maximum, lit.max(axis=(0, 3), initial=0.0)).ravel() > 0

    def inside(self, window: Region) -> NDArray[np.int64]:
        """Return the tiles that overlap ``window``."""
        rows = np.arange(window.top // TILE, -(-window.bottom // TILE))
        columns = np.arange(window.left // TILE, -(-window.right // TILE))
        return np.asarray((rows[:, None] * self._across + columns).ravel(), dtype=np.int64)

    def lit_inside(self, window: Region) -> NDArray[np.int64]:
        """Return the tiles on which a shadow can be seen."""
        tiles = self.inside(window)
        return tiles[self._lit[tiles]]

    def about(self, tiles: NDArray[np.int64], reach_px: int) -> NDArray[np.int64]:
        """Return ``tiles`` and all that have a pixel within ``reach_px`` of them."""
        marked, grown = np.zeros((self._down, self._across), dtype=np.uint8), -(-reach_px // TILE)
        marked.ravel()[tiles] = 1
        return np.flatnonzero(cv2.dilate(marked, np.ones((2 * grown + 1, 2 * grown + 1), dtype=np.uint8)))

    def showing(self, tiles: NDArray[np.int64], centre_m: Array, reach_m: float) -> NDArray[np.int64]:
        """Return those of ``tiles`` in which a body within ``reach_m`` of ``centre_m`` can appear."""
        apart = centre_m - self._origin
        distance = float(np.linalg.norm(apart))
        if distance <= reach_m:
            return tiles
        wider = math.asin(reach_m / distance) + 0.01  # half a pixel
        widest = self._cosine[tiles] * math.cos(wider) - self._sine[tiles] * math.sin(wider)
        return np.asarray(tiles[self._axis[tiles] @ apart >= distance * widest])

    def shaded(self, tiles: NDArray[np.int64], centre_m: Array, reach_m: float, lamp_m: Array) -> NDArray[np.int64]:
        """Return those of ``tiles`` whose background a body within ``reach_m`` of ``centre_m`` can shade from
        ``lamp_m``.
        """
        start = self._centre[tiles]
        towards, apart = lamp_m - start, centre_m - start
        fraction = np.clip((towards * apart).sum(axis=1) / (towards * towards).sum(axis=1), 0.0, 1.0)
        off = np.linalg.norm(apart - fraction[:, None] * towards, axis=1)
        return np.asarray(tiles[off <= reach_m + self._reach[tiles] + 1e-6])

    def showing_part(self, tiles: NDArray[np.int64], part: Part) -> NDArray[np.bool_]:
        """Mark those (n,) of ``tiles`` in which a ray through one of their pixels can meet ``part``."""
        far = float(np.linalg.norm(part.centre_m - self._origin)) + part.reach_m
        return bundles_meeting(part, self._origin[None], self._axis[tiles], far, self._chord[tiles] * far)

    def shaded_by_part(self, tiles: NDArray[np.int64], part: Part, lamp_m: Array) -> NDArray[np.bool_]:
        """Return the background of which (n,) of ``tiles`` ``part`` can shade from ``lamp_m``."""
        centre = self._centre[tiles]
        return bundles_meeting(part, centre, lamp_m - centre, 1.0, self._reach[tiles])


def bundles_meeting(part: Part, starts: Array, rays: Array, far: float, widths: Array) -> NDArray[np.bool_]:
    """Return which bundles (n,) of rays may meet the part's box, wherever it is meanwhile."""
    may = np.empty(len(rays), dtype=np.bool_)
    bundles_into_box(
        starts, rays, far, widths + part.travel_m + 1e-6, part.centre_m, part.reach_m, part.into[0],
        part.surface.low, part.surface.high, may,
    )  # fmt: skip
    return may


def _of_tiles(ufunc: np.ufunc, values: Array) -> Array:
    """Return one number (or vector) for each tile (down, across): ``ufunc`` of those of its pixels (h, w)."""
    rows, columns = (np.arange(0, size, TILE) for size in values.shape[:2])
    return np.asarray(ufunc.reduceat(ufunc.reduceat(values, rows, axis=0), columns, axis=1))


def _of_pixels(values: Array, height: int, width: int) -> Array:
    """Return the numbers of each pixel's tile (h, w)."""
    return values.repeat(TILE, axis=0)[:height].repeat(TILE, axis=1)[:, :width]
