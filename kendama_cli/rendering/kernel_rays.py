# ruff: noqa: PLR0917 - compiled code takes arrays one by one
"""Rays through pixels and from points to lamps, transformed into the meshes' own frames, as compiled code.

``into`` (k, 3, 4) are a mesh's maps from the world at k times; ``tau`` in [0, k - 1] is a ray's own time. A tile is
a square of ``TILE`` pixels.
"""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.system.compiled import Array, compiled

TILE = 16
BEYOND = 1.0001
"""A ray is followed so much farther than what it has met: a mesh in single precision may touch its box before that."""


@compiled
def pose_at(into: Array, tau: float, pose: Array) -> None:
    """Interpolate ``pose`` (3, 4) at ``tau``, linearly between the times."""
    k = min(max(int(tau), 0), len(into) - 2)
    f = tau - k
    for i in range(3):
        for j in range(4):
            pose[i, j] = into[k, i, j] + f * (into[k + 1, i, j] - into[k, i, j])


@compiled
def enters(o: Array, d: Array, low: Array, high: Array, far: float) -> bool:
    """Return True if the ray o + t d, 0 <= t <= far, meets the box."""
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
    """Return True if the ray o + t d, t >= 0, surely passes a sphere."""
    gx, gy, gz = centre[0] - ox, centre[1] - oy, centre[2] - oz
    length2, along = dx * dx + dy * dy + dz * dz, gx * dx + gy * dy + gz * dz
    beyond2 = gx * gx + gy * gy + gz * gz - reach * reach  # it starts outside
    passes: bool = beyond2 > 0 and (along <= 0 or beyond2 * length2 > along * along)
    return passes


@compiled
def local_ray(start: Array, towards: Array, pose: Array, o: Array, d: Array) -> None:
    """Transform ``start`` and ``towards`` from the world into a mesh's frame."""
    for i in range(3):
        o[i] = pose[i, 0] * start[0] + pose[i, 1] * start[1] + pose[i, 2] * start[2] + pose[i, 3]
        d[i] = pose[i, 0] * towards[0] + pose[i, 1] * towards[1] + pose[i, 2] * towards[2]


@compiled
def bundles_into_box(
    starts: Array, rays: Array, far: float, widths: Array, centre: Array, reach: float, pose: Array, low: Array,
    high: Array, may: Array,
) -> None:  # fmt: skip
    """Set ``may`` (n,) where a ray of a bundle may meet a box in a sphere; ``pose`` (3, 4) takes world points to the
    box.

    A bundle stays within its ``width`` [m] of its axis, ``starts`` (n, 3) or (1, 3) + t ``rays`` (n, 3), 0 <= t <= far.
    A ball of the world is as wide along a side of the box as the pose's row there is long.
    """
    o, d, below, above = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(len(rays)):
        start, ray = starts[0 if len(starts) == 1 else n], rays[n]
        if misses(start[0], start[1], start[2], ray[0], ray[1], ray[2], centre, reach + widths[n]):
            may[n] = False
            continue
        local_ray(start, ray, pose, o, d)
        for i in range(3):
            grown = widths[n] * math.sqrt(pose[i, 0] ** 2 + pose[i, 1] ** 2 + pose[i, 2] ** 2)
            below[i], above[i] = low[i] - grown, high[i] + grown
        may[n] = enters(o, d, below, above, far)


@compiled
def pixels_into_mesh(
    tiles: Array, window: Array, field: Array, position: Array, shadow: bool, row_tau: Array, far: Array,
    centre: Array, reach: float, into: Array, low: Array, high: Array, index: Array, origins: Array, directions: Array,
) -> int:  # fmt: skip
    """Return one ray per pixel of ``tiles`` that may meet a mesh bounded by a sphere; the number of rays written.

    From ``position`` along ``field``, the camera's rays, or, for a ``shadow``, from ``field``, points, to the lamp at
    ``position``. ``window`` is left, top, right, bottom; ``far`` (h, w), of the image as ``field`` is, says how many
    times its length a pixel's ray goes.
    """
    pose, o, d, towards = np.empty((3, 4)), np.empty(3), np.empty(3), np.empty(3)
    width = field.shape[1]
    across = (width + TILE - 1) // TILE
    count = 0
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for v in range(max(top, window[1]), min(top + TILE, window[3])):
            pose_at(into, row_tau[v], pose)
            for u in range(max(left, window[0]), min(left + TILE, window[2])):
                if far[v, u] == 0:
                    continue
                if shadow:
                    x, y, z = field[v, u, 0], field[v, u, 1], field[v, u, 2]
                    towards[0], towards[1], towards[2] = position[0] - x, position[1] - y, position[2] - z
                    if misses(x, y, z, towards[0], towards[1], towards[2], centre, reach):
                        continue
                    local_ray(field[v, u], towards, pose, o, d)
                else:
                    local_ray(position, field[v, u], pose, o, d)
                if enters(o, d, low, high, far[v, u] * BEYOND):
                    index[count] = v * width + u
                    for i in range(3):
                        origins[count, i], directions[count, i] = o[i], d[i]
                    count += 1
    return count


@compiled
def rays_into_mesh(
    tiles: Array, first: Array, starts: Array, ends: Array, taus: Array, active: Array, far: Array, centre: Array,
    reach: float, into: Array, low: Array, high: Array, index: Array, origins: Array, directions: Array,
) -> int:  # fmt: skip
    """Return the active rays of some tiles that may meet a mesh bounded by a sphere; the number written.

    Rays ``first[k]`` to ``first[k + 1]`` of the n are of tile k. ``starts`` and ``ends`` are (n, 3) or (1, 3) for all;
    a ray's parameter is 0 at its start and 1 at its end, and it goes up to ``far`` (n,).
    """
    pose, o, d, towards = np.empty((3, 4)), np.empty(3), np.empty(3), np.empty(3)
    count, posed = 0, math.nan
    from_one, to_one = len(starts) == 1, len(ends) == 1
    for tile in tiles:
        for n in range(first[tile], first[tile + 1]):
            if active[n] == 0:
                continue
            start, end = starts[0 if from_one else n], ends[0 if to_one else n]
            for i in range(3):
                towards[i] = end[i] - start[i]
            if misses(start[0], start[1], start[2], towards[0], towards[1], towards[2], centre, reach):
                continue
            if taus[n] != posed:
                posed = taus[n]
                pose_at(into, posed, pose)
            local_ray(start, towards, pose, o, d)
            if enters(o, d, low, high, far[n] * BEYOND):
                index[count] = n
                for i in range(3):
                    origins[count, i], directions[count, i] = o[i], d[i]
                count += 1
    return count


@compiled
def bound_starts(first: Array, active: Array, starts: Array, center: Array, reach: Array) -> None:
    """Compute a ball about the active ``starts`` of each tile: ``center`` (m, 3), ``reach`` (m,), -1 about none."""
    low, high = np.empty(3), np.empty(3)
    for tile in range(len(first) - 1):
        low[:], high[:], reach[tile] = math.inf, -math.inf, -1.0
        for n in range(first[tile], first[tile + 1]):
            if active[n]:
                for i in range(3):
                    low[i], high[i] = min(low[i], starts[n, i]), max(high[i], starts[n, i])
        if low[0] <= high[0]:
            center[tile] = (low + high) / 2
            reach[tile] = math.sqrt(((high - low) ** 2).sum()) / 2


@compiled
def take_nearer(
    index: Array, hits: Array, origins: Array, directions: Array, anchors: Array, normals: Array, part: int,
    depth: Array, owner: Array, triangle: Array,
) -> None:  # fmt: skip
    """Enter hits of one mesh where they are nearer than what stands in ``depth``, ``owner`` and ``triangle``.

    The distance is that to the triangle's plane, t = (a - o) n / (d n) in double precision. Of equal ones the part of
    the lower number is taken, so that the order in which parts are tested does not matter.
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
        if 0 < t < depth[i] or (t == depth[i] and part < owner[i]):
            depth[i], owner[i], triangle[i] = t, part, hit


@compiled
def mark_blocked(index: Array, hits: Array, free: Array) -> None:
    """Set ``free`` to 0 for the rays that a mesh stopped."""
    for n in range(len(hits)):
        if hits[n] >= 0:
            free[index[n]] = 0
