# ruff: noqa: PLR0917 - compiled code takes arrays one by one
"""Rays through pixels and from points to lamps, handed to meshes in the meshes' own frames, as compiled code.

``into`` (k, 3, 4) are a mesh's maps from the world at k moments; ``tau`` in [0, k - 1] is a ray's own moment. A tile is
a square of ``TILE`` pixels. One file, because numba's cache notices changes in its own file only.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

compiled = njit(cache=True, error_model="numpy")
Array = Any
"""A numpy array; compiled code takes no finer annotation."""

TILE = 16
NOTHING = -1
"""Owner of a ray that met no body."""
SMOOTH, EDGE, ALL = 0, 4, 16
"""Samples of a pixel: none of its own (one ray through its middle), few, or all of the pattern."""


@compiled
def pose_at(into: Array, tau: float, pose: Array) -> None:
    """``pose`` (3, 4) at ``tau``, straight between the moments."""
    k = min(max(int(tau), 0), len(into) - 2)
    f = tau - k
    for i in range(3):
        for j in range(4):
            pose[i, j] = into[k, i, j] + f * (into[k + 1, i, j] - into[k, i, j])


@compiled
def enters(o: Array, d: Array, low: Array, high: Array, far: float) -> bool:
    """Whether the ray o + t d, 0 <= t <= far, meets the box."""
    first, last = 0.0, far
    for i in range(3):
        if d[i] == 0:
            if o[i] < low[i] or o[i] > high[i]:
                return False
            continue
        a, b = (low[i] - o[i]) / d[i], (high[i] - o[i]) / d[i]
        first, last = max(first, min(a, b)), min(last, max(a, b))
    return first <= last


@compiled
def misses(ox: float, oy: float, oz: float, dx: float, dy: float, dz: float, centre: Array, reach: float) -> bool:
    """Whether the ray o + t d, t >= 0, surely passes a sphere."""
    gx, gy, gz = centre[0] - ox, centre[1] - oy, centre[2] - oz
    length2, along = dx * dx + dy * dy + dz * dz, gx * dx + gy * dy + gz * dz
    beyond2 = gx * gx + gy * gy + gz * gz - reach * reach  # it starts outside
    passes: bool = beyond2 > 0 and (along <= 0 or beyond2 * length2 > along * along)
    return passes


@compiled
def local_ray(start: Array, towards: Array, pose: Array, o: Array, d: Array) -> None:
    """``start`` and ``towards`` of the world in a mesh's frame."""
    for i in range(3):
        o[i] = pose[i, 0] * start[0] + pose[i, 1] * start[1] + pose[i, 2] * start[2] + pose[i, 3]
        d[i] = pose[i, 0] * towards[0] + pose[i, 1] * towards[1] + pose[i, 2] * towards[2]


@compiled
def bundles_into_box(
    starts: Array, ways: Array, far: float, widths: Array, pose: Array, low: Array, high: Array, may: Array
) -> None:
    """Whether (n,) any ray of a bundle may meet a box that ``pose`` (3, 4) takes world points to.

    A bundle stays within its ``width`` [m] of its axis, ``starts`` (n, 3) or (1, 3) + t ``ways`` (n, 3), 0 <= t <= far.
    A ball of the world is as wide along a side of the box as the pose's row there is long.
    """
    o, d, below, above = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(len(ways)):
        local_ray(starts[0 if len(starts) == 1 else n], ways[n], pose, o, d)
        for i in range(3):
            grown = widths[n] * math.sqrt(pose[i, 0] ** 2 + pose[i, 1] ** 2 + pose[i, 2] ** 2)
            below[i], above[i] = low[i] - grown, high[i] + grown
        may[n] = enters(o, d, below, above, far)


@compiled
def pixels_into_mesh(
    tiles: Array, window: Array, field: Array, place: Array, shadow: bool, row_tau: Array, wanted: Array,
    centre: Array, reach: float, into: Array, low: Array, high: Array, index: Array, origins: Array, directions: Array,
) -> int:  # fmt: skip
    """One ray per wanted pixel of ``tiles`` that may meet a mesh bounded by a sphere; the number of rays written.

    From ``place`` along ``field``, the camera's rays, or, for a ``shadow``, from ``field``, points, to the lamp at
    ``place``. ``window`` is left, top, right, bottom; ``wanted`` (h, w) is of the whole image as ``field`` is.
    """
    pose, o, d, towards = np.empty((3, 4)), np.empty(3), np.empty(3), np.empty(3)
    width = field.shape[1]
    across = (width + TILE - 1) // TILE
    count = 0
    far = 1.0 if shadow else math.inf
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for v in range(max(top, window[1]), min(top + TILE, window[3])):
            pose_at(into, row_tau[v], pose)
            for u in range(max(left, window[0]), min(left + TILE, window[2])):
                if wanted[v, u] == 0:
                    continue
                if shadow:
                    x, y, z = field[v, u, 0], field[v, u, 1], field[v, u, 2]
                    towards[0], towards[1], towards[2] = place[0] - x, place[1] - y, place[2] - z
                    if misses(x, y, z, towards[0], towards[1], towards[2], centre, reach):
                        continue
                    local_ray(field[v, u], towards, pose, o, d)
                else:
                    local_ray(place, field[v, u], pose, o, d)
                if enters(o, d, low, high, far):
                    index[count] = v * width + u
                    for i in range(3):
                        origins[count, i], directions[count, i] = o[i], d[i]
                    count += 1
    return count


@compiled
def rays_into_mesh(
    starts: Array, ends: Array, taus: Array, wanted: Array, centre: Array, reach: float, into: Array,
    low: Array, high: Array, far: float, index: Array, origins: Array, directions: Array,
) -> int:  # fmt: skip
    """The wanted rays of a list that may meet a mesh bounded by a sphere; the number written.

    ``starts`` and ``ends`` are (n, 3) or (1, 3) for all; a ray's parameter is 0 at its start and 1 at its end, and it
    goes up to ``far``.
    """
    pose, o, d, towards = np.empty((3, 4)), np.empty(3), np.empty(3), np.empty(3)
    count, posed = 0, math.nan
    from_one, to_one = len(starts) == 1, len(ends) == 1
    for n in range(len(taus)):
        if wanted[n] == 0:
            continue
        a, b = 0 if from_one else n, 0 if to_one else n
        ox, oy, oz = starts[a, 0], starts[a, 1], starts[a, 2]
        dx, dy, dz = ends[b, 0] - ox, ends[b, 1] - oy, ends[b, 2] - oz
        if misses(ox, oy, oz, dx, dy, dz, centre, reach):
            continue
        start = starts[a]
        towards[0], towards[1], towards[2] = dx, dy, dz
        if taus[n] != posed:
            posed = taus[n]
            pose_at(into, posed, pose)
        local_ray(start, towards, pose, o, d)
        if enters(o, d, low, high, far):
            index[count] = n
            for i in range(3):
                origins[count, i], directions[count, i] = o[i], d[i]
            count += 1
    return count


@compiled
def take_nearer(
    index: Array, hits: Array, origins: Array, directions: Array, anchors: Array, normals: Array, part: int,
    depth: Array, owner: Array, triangle: Array,
) -> None:  # fmt: skip
    """Enter hits of one mesh where they are nearer than what stands in ``depth``, ``owner`` and ``triangle``.

    The distance is that to the triangle's plane, t = (a - o) n / (d n) in double precision.
    """
    for n in range(len(hits)):
        hit = hits[n]
        if hit < 0:
            continue
        above = slope = 0.0
        for i in range(3):
            above += (anchors[hit, i] - np.float64(origins[n, i])) * normals[hit, i]
            slope += np.float64(directions[n, i]) * normals[hit, i]
        if slope == 0:
            continue
        t, i = above / slope, index[n]
        if 0 < t < depth[i]:
            depth[i], owner[i], triangle[i] = t, part, hit


@compiled
def mark_blocked(index: Array, hits: Array, free: Array) -> None:
    """Set ``free`` to 0 for the rays that a mesh stopped."""
    for n in range(len(hits)):
        if hits[n] >= 0:
            free[index[n]] = 0


@compiled
def mark_near(
    tiles: Array, window: Array, rays: Array, origin: Array, a: Array, b: Array, reach: float, spread: float, bit: int,
    samples: int, level: Array, bits: Array,
) -> None:  # fmt: skip
    """Ask for ``samples`` in the pixels whose rays pass within ``reach`` of the way from ``a`` to ``b``.

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
                    gap, way = a[i] - origin[i], b[i] - a[i]
                    da += d[i] * gap
                    dw += d[i] * way
                    ww += way * way
                    aw += gap * way
                    aa += gap * gap
                sideways = ww - dw * dw / dd
                share = min(max(-(aw - da * dw / dd) / sideways, 0.0), 1.0) if sideways > 1e-18 else 0.0
                forward = (da + share * dw) / dd
                off2 = aa + 2 * share * aw + share * share * ww - forward * forward * dd
                margin = reach + spread * abs(forward)
                if forward > -reach and off2 <= margin * margin:
                    level[v, u] = max(level[v, u], samples)
                    bits[v, u] |= 1 << bit


@compiled
def mark_edges(window: Array, owner: Array, depth: Array, blur: int, samples: int, level: Array) -> None:
    """Ask for ``samples`` ``blur`` pixels about every border between meshes, or leap in depth by more than 2 %."""
    left, top, right, bottom = window[0], window[1], window[2], window[3]
    for v in range(top, bottom):
        for u in range(left, right):
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
    """Flat indices (n,) of the pixels of ``tiles`` in ``window``."""
    pixels = np.empty(len(tiles) * TILE * TILE, dtype=np.int64)
    across, count = (width + TILE - 1) // TILE, 0
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for v in range(max(top, window[1]), min(top + TILE, window[3])):
            for u in range(max(left, window[0]), min(left + TILE, window[2])):
                pixels[count] = v * width + u
                count += 1
    return pixels[:count]
