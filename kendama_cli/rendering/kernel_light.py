# ruff: noqa: PLR0917 - compiled code takes arrays one by one
"""Samples of pixels, their light, and how a sensor turns light into numbers, as compiled code."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.system.compiled import Array, compiled

TILE = 16
SMOOTH = 0
TWO_TONE, STRIPED, WOODEN = 1, 2, 3
"""Patterns of a ball; 0 is one colour."""
BALL_OWNER, SECOND_OWNER = -2, -5
"""Owners of samples on the ball's first and second colour."""
BAND, RINGS, WAVES = 0.25, 14.0, 5.0
"""Half width of a band over the ball's radius; rings of grain across a ball of radius 1, and how they wave."""
WEYL, MIX_A, MIX_B = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
"""splitmix64's constants (Steele, Lea, Flood 2014)."""
BYTES_MEAN, BYTES_SIGMA = 8 * 127.5, math.sqrt(8 * (256**2 - 1) / 12)
"""Mean and standard deviation of the sum of eight random bytes."""


@compiled
def count_samples(tiles: Array, region: Array, level: Array, owner: Array, first: Array) -> None:
    """Compute the ``first`` (m + 1,) of the samples that ``list_samples`` writes for each of m tiles, and of all."""
    across = (level.shape[1] + TILE - 1) // TILE
    count = 0
    for k in range(len(tiles)):
        first[k] = count
        top, left = tiles[k] // across * TILE, tiles[k] % across * TILE
        for v in range(max(top, region[1]), min(top + TILE, region[3])):
            for u in range(max(left, region[0]), min(left + TILE, region[2])):
                if level[v, u] != SMOOTH:
                    count += level[v, u]
                elif owner[v, u] >= 0:
                    count += 1
    first[len(tiles)] = count


@compiled
def list_samples(
    tiles: Array, region: Array, rays: Array, level: Array, bits: Array, owner: Array, depth: Array, triangle: Array,
    row_tau: Array, spread_tau: float, pattern: Array, pixel: Array, weight: Array, direction: Array, tau: Array,
    near: Array, s_owner: Array, s_depth: Array, s_triangle: Array, fresh: Array,
) -> None:  # fmt: skip
    """Write the samples tile by tile: one per pixel inside a mesh, which is known, and 4 or 16 fresh ones elsewhere.

    ``pattern`` (16, 3) holds each sample's offset to the right and down [px] and its part of the exposure from the
    centre; a pixel of four samples takes every fourth. A pixel's ray bends by its neighbours' central differences.
    """
    height, width = rays.shape[0], rays.shape[1]
    across = (width + TILE - 1) // TILE
    n = 0
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for v in range(max(top, region[1]), min(top + TILE, region[3])):
            above, below = max(v - 1, 0), min(v + 1, height - 1)
            for u in range(max(left, region[0]), min(left + TILE, region[2])):
                samples = level[v, u]
                if samples == SMOOTH:
                    if owner[v, u] >= 0:
                        pixel[n], weight[n], tau[n], near[n], fresh[n] = v * width + u, 1.0, row_tau[v], 0, 0
                        s_owner[n], s_depth[n], s_triangle[n] = owner[v, u], depth[v, u], triangle[v, u]
                        for i in range(3):
                            direction[n, i] = rays[v, u, i]
                        n += 1
                    continue
                before, after = max(u - 1, 0), min(u + 1, width - 1)
                for s in range(0, 16, 16 // samples):
                    right, down = pattern[s, 0] / (after - before), pattern[s, 1] / (below - above)
                    for i in range(3):
                        direction[n, i] = (
                            rays[v, u, i]
                            + right * (rays[v, after, i] - rays[v, before, i])
                            + down * (rays[below, u, i] - rays[above, u, i])
                        )
                    pixel[n], weight[n], near[n], fresh[n] = v * width + u, 1.0 / samples, bits[v, u], 1
                    tau[n] = row_tau[v] + spread_tau * pattern[s, 2]
                    s_owner[n], s_depth[n], s_triangle[n] = -1, math.inf, -1
                    n += 1


@compiled
def mesh_normals(owner: Array, triangle: Array, tau: Array, part: int, into: Array, facets: Array, out: Array) -> None:
    """Compute unit normals (n, 3) in the world of the samples on one mesh: n_world = into^T n, scaled."""
    for n in range(len(owner)):
        if owner[n] != part:
            continue
        k = min(max(int(tau[n]), 0), len(into) - 2)
        f, length2 = tau[n] - k, 0.0
        for i in range(3):
            value = 0.0
            for j in range(3):
                value += (into[k, j, i] + f * (into[k + 1, j, i] - into[k, j, i])) * facets[triangle[n], j]
            out[n, i] = value
            length2 += value * value
        for i in range(3):
            out[n, i] /= math.sqrt(length2)


@compiled
def touch(
    origin: Array, direction: Array, depth: Array, owner: Array, normal: Array, lift_m: float, start: Array
) -> None:
    """Turn mesh normals to the camera, and write where rays to the lamps begin: just above what was hit."""
    for n in range(len(depth)):
        if owner[n] == -1:
            continue
        lift = 1e-6 if owner[n] < -1 else lift_m
        if owner[n] >= 0:
            facing = 0.0
            for i in range(3):
                facing += normal[n, i] * direction[n, i]
            if facing > 0:
                for i in range(3):
                    normal[n, i] = -normal[n, i]
        for i in range(3):
            start[n, i] = origin[i] + depth[n] * direction[n, i] + lift * normal[n, i]


@compiled
def face(owner: Array, normal: Array, start: Array, lamp: Array, cosine: Array, lit: Array) -> None:
    """Compute Lambert's cosine (n,) of each sample to a lamp, and mark those that face it."""
    for n in range(len(owner)):
        lit[n] = 0
        if owner[n] == -1:
            continue
        along = length2 = 0.0
        for i in range(3):
            towards = lamp[i] - start[n, i]
            along += normal[n, i] * towards
            length2 += towards * towards
        if along > 0:
            cosine[n], lit[n] = along / math.sqrt(length2), 1


@compiled
def add_light(free: Array, strength: Array, cosine: Array, brightness: float, irradiance: Array) -> None:
    """Add one lamp's light (n,) to what it reaches."""
    for n in range(len(free)):
        if free[n]:
            irradiance[n] += strength[n] * brightness * cosine[n]


@compiled
def paint_ball(owner: Array, normal: Array, rotation: Array, pattern: int) -> None:
    """Give samples on the ball's second colour their own owner; ``rotation`` (3, 3) has the ball's axes as columns."""
    for n in range(len(owner)):
        if owner[n] != BALL_OWNER:
            continue
        x = y = z = 0.0
        for i in range(3):
            x += rotation[i, 0] * normal[n, i]
            y += rotation[i, 1] * normal[n, i]
            z += rotation[i, 2] * normal[n, i]
        if pattern == TWO_TONE:
            second = z < 0.0
        elif pattern == STRIPED:
            second = abs(z) < BAND
        else:
            second = math.sin(RINGS * x + math.sin(WAVES * y)) > 0.5
        if second:
            owner[n] = SECOND_OWNER


@compiled
def collect(
    pixel: Array, weight: Array, owner: Array, irradiance: Array, paints: Array, level: Array, region: Array,
    image: Array,
) -> None:  # fmt: skip
    """Put the samples' light into ``image`` (h, w, 3) of ``region``, which holds the background's light at first.

    ``paints`` are the reflectances: of the parts by number, then the ball's second colour, rope, cup and ball.
    """
    width = level.shape[1]
    last = -1
    background = np.zeros(3)
    for n in range(len(pixel)):
        v, u = pixel[n] // width, pixel[n] % width
        y, x = v - region[1], u - region[0]
        if pixel[n] != last:
            last = pixel[n]
            for i in range(3):
                background[i], image[y, x, i] = image[y, x, i], 0.0
        which = owner[n]
        for i in range(3):
            light = background[i] if which == -1 else irradiance[n] * paints[which if which >= 0 else which + 1, i]
            image[y, x, i] += weight[n] * light


@compiled
def background_light(
    tiles: Array, region: Array, unlit: Array, lit: Array, free: Array, strength: Array, image: Array
) -> None:
    """Write the background's light in ``tiles`` to ``image``: its own, and each lamp's where nothing stands between."""
    across = (unlit.shape[1] + TILE - 1) // TILE
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for v in range(max(top, region[1]), min(top + TILE, region[3])):
            for u in range(max(left, region[0]), min(left + TILE, region[2])):
                y, x = v - region[1], u - region[0]
                for i in range(3):
                    image[y, x, i] = unlit[v, u, i]
                for lamp in range(len(lit)):
                    if free[lamp, v, u]:
                        for i in range(3):
                            image[y, x, i] += strength[v] * lit[lamp, v, u, i]


@compiled
def shadowed(tiles: Array, free: Array, found: Array) -> None:
    """Mark in ``found``, one for each tile of the image, those of ``tiles`` with a pixel that a lamp does not reach."""
    across = (free.shape[2] + TILE - 1) // TILE
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        found[tile] |= free[:, top : top + TILE, left : left + TILE].min() == 0


@compiled
def digitise(
    light: Array, left: int, top: int, width: int, key: np.uint64, gain: float, full_well_e: float, read_e: float,
    levels: Array, out: Array,
) -> None:  # fmt: skip
    """Convert electrons with shot and read noise, clipped at the full well, to 8 bits by the table ``levels``; BGR.

    The noise of a pixel depends on ``key`` and the pixel's position alone: the sum of eight bytes of splitmix64, which
    is normal to 5 sigma but for a kurtosis of -0.15.
    """
    top_level = len(levels) - 1
    for y in range(light.shape[0]):
        for x in range(light.shape[1]):
            for i in range(3):
                electrons = light[y, x, 2 - i] * gain * full_well_e
                z = key + WEYL * np.uint64(((y + top) * width + x + left) * 3 + i + 1)
                z = (z ^ (z >> np.uint64(30))) * MIX_A
                z = (z ^ (z >> np.uint64(27))) * MIX_B
                z ^= z >> np.uint64(31)
                pairs = (z & np.uint64(0x00FF00FF00FF00FF)) + ((z >> np.uint64(8)) & np.uint64(0x00FF00FF00FF00FF))
                total = (pairs * np.uint64(0x0001000100010001)) >> np.uint64(48)
                noise = (np.float64(total) - BYTES_MEAN) / BYTES_SIGMA
                seen = (electrons + noise * math.sqrt(electrons + read_e * read_e)) / full_well_e
                out[y, x, i] = levels[int(min(max(seen, 0.0), 1.0) * top_level + 0.5)]
