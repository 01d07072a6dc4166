# ruff: noqa: PLR0917 - compiled code takes arrays one by one
"""Marks of the pixels that see more than the background, and the samples that each needs, as compiled code.

A tile is a square of ``TILE`` pixels.
"""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.system.compiled import Array, compiled

TILE = 16
NOTHING = -1
"""Owner of a ray that met no body."""
SMOOTH, EDGE, ALL = 0, 4, 16
"""Samples of a pixel: none of its own (one ray through its centre), few, or all of the pattern."""


@compiled
def mark_near(
    tiles: Array, window: Array, rays: Array, origin: Array, a: Array, b: Array, reach: float, spread: float, bit: int,
    samples: int, level: Array, bits: Array,
) -> None:  # fmt: skip
    """Ask for ``samples`` in the pixels whose rays pass within ``reach`` of the segment from ``a`` to ``b``.

    ``spread`` is half a pixel's diagonal in units of the ray's length along the optical axis. The distance of line
    and segment is that of the segment's nearest point to the line, the segment seen along the line.
    """
    width = rays.shape[1]
    across = (width + TILE - 1) // TILE
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for v in range(max(top, window[1]), min(top + TILE, window[3])):
            for u in range(max(left, window[0]), min(left + TILE, window[2])):
                d = rays[v, u]
                dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
                da = dw = ww = aw = aa = 0.0
                for i in range(3):
                    gap, along = a[i] - origin[i], b[i] - a[i]
                    da += d[i] * gap
                    dw += d[i] * along
                    ww += along * along
                    aw += gap * along
                    aa += gap * gap
                lateral = ww - dw * dw / dd
                fraction = min(max(-(aw - da * dw / dd) / lateral, 0.0), 1.0) if lateral > 1e-18 else 0.0
                forward = (da + fraction * dw) / dd
                off2 = aa + 2 * fraction * aw + fraction * fraction * ww - forward * forward * dd
                margin = reach + spread * abs(forward)
                if forward > -reach and off2 <= margin * margin:
                    level[v, u] = max(level[v, u], samples)
                    bits[v, u] |= 1 << bit


@compiled
def forget(tiles: Array, level: Array, bits: Array, owner: Array, depth: Array) -> None:
    """Leave all pixels of ``tiles`` to the background."""
    across = (level.shape[1] + TILE - 1) // TILE
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for v in range(top, min(top + TILE, level.shape[0])):
            for u in range(left, min(left + TILE, level.shape[1])):
                level[v, u], bits[v, u], owner[v, u], depth[v, u] = SMOOTH, 0, NOTHING, math.inf


@compiled
def mark_edges(
    tiles: Array, window: Array, owner: Array, depth: Array, blur: int, samples: int, level: Array
) -> None:  # fmt: skip
    """Ask for ``samples`` ``blur`` pixels about every border between meshes, or leap in depth by more than 2 %.

    ``tiles`` must hold the pixel to the left of and above each border.
    """
    left, top, right, bottom = window[0], window[1], window[2], window[3]
    across = (owner.shape[1] + TILE - 1) // TILE
    for tile in tiles:
        first_row, first_column = tile // across * TILE, tile % across * TILE
        for v in range(max(first_row, top), min(first_row + TILE, bottom)):
            for u in range(max(first_column, left), min(first_column + TILE, right)):
                for down in range(2):
                    y, x = v + down, u + 1 - down
                    if y >= bottom or x >= right:
                        continue
                    same = owner[v, u] == owner[y, x]
                    if same and (owner[v, u] < 0 or abs(depth[v, u] - depth[y, x]) < 0.02 * depth[v, u]):
                        continue
                    for j in range(max(v - blur, top), min(y + blur + 1, bottom)):
                        for i in range(max(u - blur, left), min(x + blur + 1, right)):
                            level[j, i] = samples


@compiled
def pixels_of(tiles: Array, window: Array, width: int) -> Array:
    """Return the flat indices (n,) of the pixels of ``tiles`` in ``window``."""
    pixels = np.empty(len(tiles) * TILE * TILE, dtype=np.int64)
    across, count = (width + TILE - 1) // TILE, 0
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for v in range(max(top, window[1]), min(top + TILE, window[3])):
            for u in range(max(left, window[0]), min(left + TILE, window[2])):
                pixels[count] = v * width + u
                count += 1
    return pixels[:count]
