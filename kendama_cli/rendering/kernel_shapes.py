# ruff: noqa: PLR0917 - compiled code takes arrays one by one
"""Ball, cup and rope by their closed forms, as compiled code: where a ray meets them first, and who shades whom.

A ray is p = o + t d with d of any length; a miss has t = inf. All poses come as arrays of k times, and ``tau`` in
[0, k - 1] is the ray's own time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kendama_cli.system.compiled import Array, compiled

NEAR = 1e-6
"""A ray that starts on a surface does not hit that surface again."""
BALL, CUP, ROPE, PIECES = 0, 1, 2, 60
"""Bits of the bodies in a pixel's 64, the rope's pieces from ROPE on (the 61st has the first's bit)."""


class Sizes(NamedTuple):
    """Sizes of ball, cup and rope [m]; ``cup_floor_m`` is the floor's height over the cup's origin, or 0."""

    ball_m: float
    cup_inner_m: float
    cup_outer_m: float
    cup_depth_m: float
    cup_wall_m: float
    cup_floor_m: float
    handle_m: float
    rope_m: float


@compiled
def moment(count: int, tau: float) -> tuple[int, float]:
    """Return the index before ``tau`` and the fraction to the next."""
    k = min(max(int(tau), 0), count - 2)
    return k, tau - k


@compiled
def first_root(a: float, half_b: float, c: float) -> float:
    """Return the smaller positive t of a t^2 + 2 half_b t + c = 0, from outside the solid; inf where there is none."""
    d = half_b * half_b - a * c
    if d <= 0 or a <= 0:
        return math.inf
    t = (-half_b - math.sqrt(d)) / a
    return t if t > NEAR else math.inf


@compiled
def last_root(a: float, half_b: float, c: float) -> float:
    """Return the larger positive t, where a ray leaves the solid; inf where there is none."""
    d = half_b * half_b - a * c
    if d <= 0 or a <= 0:
        return math.inf
    t = (-half_b + math.sqrt(d)) / a
    return t if t > NEAR else math.inf


@compiled
def sphere(o: Array, d: Array, centres: Array, tau: float, radius: float, normal: Array) -> float:
    """Return a ball; ``normal`` (3,) is written where it is hit."""
    k, f = moment(len(centres), tau)
    aa = ab = bb = 0.0
    for i in range(3):
        gap = o[i] - (centres[k, i] + f * (centres[k + 1, i] - centres[k, i]))
        normal[i] = gap
        aa += d[i] * d[i]
        ab += d[i] * gap
        bb += gap * gap
    t = first_root(aa, ab, bb - radius * radius)
    if t < math.inf:
        for i in range(3):
            normal[i] = (normal[i] + t * d[i]) / radius
    return t


@compiled
def capsule(o: Array, d: Array, points: Array, piece: int, tau: float, radius: float, normal: Array) -> float:
    """Intersect the piece ``piece`` of the rope (k, n, 3): a cylinder with round ends."""
    k, f = moment(len(points), tau)
    aa = ab = bb = da = oa = length2 = gap2 = dgap = 0.0
    for i in range(3):
        a = points[k, piece, i] + f * (points[k + 1, piece, i] - points[k, piece, i])
        b = points[k, piece + 1, i] + f * (points[k + 1, piece + 1, i] - points[k, piece + 1, i])
        axis, gap = b - a, o[i] - a
        length2 += axis * axis
        da += d[i] * axis
        oa += gap * axis
        aa += d[i] * d[i]
        ab += d[i] * gap
        bb += gap * gap
        gap2 += (o[i] - b) ** 2
        dgap += d[i] * (o[i] - b)
    t = min(first_root(aa, ab, bb - radius * radius), first_root(aa, dgap, gap2 - radius * radius))
    if length2 > 0:
        side = first_root(aa - da * da / length2, ab - da * oa / length2, bb - oa * oa / length2 - radius * radius)
        part = (oa + side * da) / length2
        if side < t and 0 <= part <= 1:
            t = side
    if t < math.inf:
        part = min(max((oa + t * da) / length2, 0.0), 1.0) if length2 > 0 else 0.0
        for i in range(3):
            a = points[k, piece, i] + f * (points[k + 1, piece, i] - points[k, piece, i])
            b = points[k, piece + 1, i] + f * (points[k + 1, piece + 1, i] - points[k, piece + 1, i])
            normal[i] = (o[i] + t * d[i] - a - part * (b - a)) / radius
    return t


@compiled
def open_cup(o: Array, d: Array, positions: Array, rotations: Array, tau: float, s: Sizes, normal: Array) -> float:
    """Return a round cup of wall, floor and rim, that can be looked into, and the handle under it."""
    k, f = moment(len(positions), tau)
    ox = oy = oz = dx = dy = dz = 0.0
    for i in range(3):
        gap = o[i] - (positions[k, i] + f * (positions[k + 1, i] - positions[k, i]))
        rx = rotations[k, i, 0] + f * (rotations[k + 1, i, 0] - rotations[k, i, 0])
        ry = rotations[k, i, 1] + f * (rotations[k + 1, i, 1] - rotations[k, i, 1])
        rz = rotations[k, i, 2] + f * (rotations[k + 1, i, 2] - rotations[k, i, 2])
        ox, oy, oz = ox + gap * rx, oy + gap * ry, oz + gap * rz
        dx, dy, dz = dx + d[i] * rx, dy + d[i] * ry, dz + d[i] * rz
    oz -= s.cup_floor_m
    aa, ab, bb = dx * dx + dy * dy, dx * ox + dy * oy, ox * ox + oy * oy
    best, nx, ny, nz = math.inf, 0.0, 0.0, 0.0
    t = first_root(aa, ab, bb - s.cup_outer_m**2)
    if t < best and 0 <= oz + t * dz <= s.cup_depth_m:
        best, nx, ny, nz = t, (ox + t * dx) / s.cup_outer_m, (oy + t * dy) / s.cup_outer_m, 0.0
    t = last_root(aa, ab, bb - s.cup_inner_m**2)
    if t < best and s.cup_wall_m <= oz + t * dz <= s.cup_depth_m:
        best, nx, ny, nz = t, -(ox + t * dx) / s.cup_inner_m, -(oy + t * dy) / s.cup_inner_m, 0.0
    if s.handle_m > 0:
        t = first_root(aa, ab, bb - s.handle_m**2)
        if t < best and -s.cup_floor_m <= oz + t * dz <= 0:
            best, nx, ny, nz = t, (ox + t * dx) / s.handle_m, (oy + t * dy) / s.handle_m, 0.0
    if dz != 0:
        for face in range(3):
            level = s.cup_depth_m if face == 0 else s.cup_wall_m if face == 1 else 0.0
            low = s.cup_inner_m if face == 0 else 0.0
            high = s.cup_inner_m if face == 1 else s.cup_outer_m
            t = (level - oz) / dz
            if NEAR < t < best and low <= math.hypot(ox + t * dx, oy + t * dy) <= high:
                best, nx, ny, nz = t, 0.0, 0.0, -1.0 if face == 2 else 1.0
    if best < math.inf:
        for i in range(3):
            rx = rotations[k, i, 0] + f * (rotations[k + 1, i, 0] - rotations[k, i, 0])
            ry = rotations[k, i, 1] + f * (rotations[k + 1, i, 1] - rotations[k, i, 1])
            rz = rotations[k, i, 2] + f * (rotations[k + 1, i, 2] - rotations[k, i, 2])
            normal[i] = nx * rx + ny * ry + nz * rz
    return best


@compiled
def meet(
    start: Array, directions: Array, taus: Array, bits: Array, balls: Array, cups: Array, rotations: Array,
    ropes: Array, sizes: Sizes, depth: Array, owner: Array, normals: Array,
) -> None:  # fmt: skip
    """Enter into ``depth``, ``owner`` and ``normals`` where rays from ``start`` meet ball, cup or rope first.

    ``bits`` say, ray by ray, which bodies are near. Owners are -2 ball, -3 cup, -4 rope.
    """
    normal = np.empty(3)
    for i in range(len(directions)):
        near = bits[i]
        if near == 0:
            continue
        d, tau = directions[i], taus[i]
        if near & 1:
            t = sphere(start, d, balls, tau, sizes.ball_m, normal)
            if t < depth[i]:
                depth[i], owner[i] = t, -2 - BALL
                normals[i, 0], normals[i, 1], normals[i, 2] = normal[0], normal[1], normal[2]
        if near & 2:
            t = open_cup(start, d, cups, rotations, tau, sizes, normal)
            if t < depth[i]:
                depth[i], owner[i] = t, -2 - CUP
                normals[i, 0], normals[i, 1], normals[i, 2] = normal[0], normal[1], normal[2]
        for piece in range(ropes.shape[1] - 1):
            if (near >> (ROPE + piece % PIECES)) & 1:
                t = capsule(start, d, ropes, piece, tau, sizes.rope_m, normal)
                if t < depth[i]:
                    depth[i], owner[i] = t, -2 - ROPE
                    normals[i, 0], normals[i, 1], normals[i, 2] = normal[0], normal[1], normal[2]


@compiled
def shade(
    starts: Array, lamp: Array, taus: Array, balls: Array, cups: Array, rotations: Array, sizes: Sizes, owner: Array,
    free: Array,
) -> None:  # fmt: skip
    """Set ``free`` (n,) to 0 where ball or cup stands between ``starts`` (n, 3) and the lamp; a rope is too thin."""
    scratch, d = np.empty(3), np.empty(3)
    half = (sizes.cup_floor_m + sizes.cup_depth_m) / 2
    cup_reach = math.hypot(sizes.cup_outer_m, half)
    for i in range(len(starts)):
        if free[i] == 0:
            continue
        k, f = moment(len(balls), taus[i])
        dd = 0.0
        for j in range(3):
            d[j] = lamp[j] - starts[i, j]
            dd += d[j] * d[j]
        ball2, ball_along, cup2, cup_along = 0.0, 0.0, 0.0, 0.0
        for j in range(3):
            gap = balls[k, j] + f * (balls[k + 1, j] - balls[k, j]) - starts[i, j]
            ball2, ball_along = ball2 + gap * gap, ball_along + gap * d[j]
            gap = cups[k, j] + f * (cups[k + 1, j] - cups[k, j]) + rotations[k, j, 2] * half - starts[i, j]
            cup2, cup_along = cup2 + gap * gap, cup_along + gap * d[j]
        if (
            owner[i] != -2 - BALL
            and 0 < ball_along < dd
            and ball2 - ball_along * ball_along / dd < sizes.ball_m**2
            and sphere(starts[i], d, balls, taus[i], sizes.ball_m, scratch) < 1
        ):
            free[i] = 0
            continue
        off2 = cup2 - cup_along * cup_along / dd
        if (
            off2 < 1.02 * cup_reach**2
            and cup_along > -cup_reach * math.sqrt(dd)
            and open_cup(starts[i], d, cups, rotations, taus[i], sizes, scratch) < 1
        ):
            free[i] = 0
