"""The rope round the cup: its shortest way from tie point to ball, and its force (docs/equations.md eq. 1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from kendama_cli.physics.side_rope import side_way
from kendama_cli.settings.game import CupSettings, GameSettings, HandleTie, SideTie

Vector = tuple[float, float, float]


class CupProfile(NamedTuple):
    """The cup as the rope goes round it: solid, round about the axis, the tie on the axis at the height 0.

    A handle of ``handle_m`` radius up to ``floor_m``, then the cup of ``radius_m`` up to ``rim_m``; without a handle
    ``handle_m`` is the cup's radius and ``floor_m`` is 0. ``used_m`` is the rope from the tie to the three edges.
    With ``side_m`` above 0 the tie is on the wall at that height over the floor, on which the cup's place is.
    """

    radius_m: float
    floor_m: float
    rim_m: float
    handle_m: float
    used_m: tuple[float, float, float]
    side_m: float = 0.0

    @classmethod
    def of(cls, cup: CupSettings) -> CupProfile:
        """That of a cup."""
        r, floor, rim = cup.outer_radius_m, cup.floor_m, cup.rim_m
        if isinstance(cup.tie, SideTie):
            return cls(r, 0.0, rim, r, (r, r, r + rim), cup.tie_m[2])
        handle = cup.tie.radius_m if isinstance(cup.tie, HandleTie) else r
        at_floor = handle + math.hypot(r - handle, floor)
        return cls(r, floor, rim, handle, (handle, at_floor, at_floor + rim - floor))

    def pivot(self, across_m: float, above_m: float) -> tuple[float, float, float]:
        """The last point that the rope touches on its way to a ball ``across_m`` from the axis, and the rope up to it.

        Distance from the axis and height over the tie of that point, then the length used, all in the half-plane of
        axis and ball. A frictionless rope takes the shortest way, which turns at convex edges only:

            z <= 0: the tie itself;  z > 0: the lower edge;  beside the rim's circle above the floor: the rim.
        """
        if above_m > self.floor_m and across_m < self.radius_m:
            return self.radius_m, self.rim_m, self.used_m[2]
        r, h, floor = self.radius_m, self.handle_m, self.floor_m
        if above_m > floor and (r - h) * above_m > floor * (across_m - h):
            return r, floor, self.used_m[1]
        if above_m > 0.0:
            return h, 0.0, self.used_m[0]
        return 0.0, 0.0, 0.0

    def way_m(self, x_m: float, y_m: float, z_m: float) -> float:
        """The rope's way from the tie of an upright cup, on the wall toward +x, to a ball at this place."""
        if self.side_m > 0.0:
            way = side_way(self.radius_m, self.rim_m, self.side_m, (x_m, y_m, z_m))
            return way.used_m + math.dist(way[:3], (x_m, y_m, z_m))
        across = math.hypot(x_m, y_m)
        out, up, used = self.pivot(across, z_m)
        return used + math.hypot(across - out, z_m - up)


@dataclass(frozen=True)
class RopeLaw:
    """Length [m], stiffness [N/m] and damping [N s/m] of the rope, and the cup that it goes round."""

    length_m: float
    stiffness_n_m: float
    damping_n_s_m: float
    cup: CupProfile

    @classmethod
    def of(cls, game: GameSettings, rope_scale: float = 1.0) -> RopeLaw:
        """That of the game, with a rope ``rope_scale`` times as long."""
        rope = game.rope
        return cls(rope.length_m * rope_scale, rope.stiffness_n_m, rope.damping_n_s_m, CupProfile.of(game.cup))


class RopePull(NamedTuple):
    """The rope's force on the ball [N]; the opposite acts on the cup at ``pivot_m`` from the tie."""

    force_n: Vector
    pivot_m: Vector


def rope_pull(  # noqa: PLR0917 - vectors one after another, as in the formula
    law: RopeLaw,
    ball_m: Vector,
    ball_m_s: Vector,
    axis: Vector = (0.0, 0.0, 1.0),
    axis_rate: Vector = (0.0, 0.0, 0.0),
    side: Vector = (1.0, 0.0, 0.0),
    spin: float = 0.0,
) -> RopePull | None:
    """The pull on a ball at ``ball_m`` from the tie with ``ball_m_s`` relative to it; None where the rope is slack.

        f = Ks d + Kd l'  if d > 0 and f > 0, else 0;   d = l - l0,  l = u + |p - q|,  n = (p - q) / |p - q|

    with p the ball, q the last point that the rope touches, both from the tie, and u the rope up to q. The force on
    the ball is -f n. The point q slides along the edge without moving the length, so that l' = n . (v - w), w being
    the velocity of the cup's material at q. ``axis`` is the cup's unit axis and ``axis_rate`` its rate: the part of
    the cup's turning about its own axis moves q across n and drops out. On the axis itself the rope lies toward
    ``side``. A rope never pushes: where damping would outweigh the spring on the way in, the force is zero.

    Where the tie is at the side, ``ball_m`` and ``ball_m_s`` count from the cup's place under it, ``side`` is the unit
    vector across the axis toward the tie, and the turning ``spin`` about the axis [rad/s] moves q along n too.
    """
    (x, y, z), (kx, ky, kz) = ball_m, axis
    if law.cup.side_m > 0.0:
        return _pull_from_side(law, ball_m, ball_m_s, (axis, axis_rate, side), spin)
    above = x * kx + y * ky + z * kz
    wx, wy, wz = x - above * kx, y - above * ky, z - above * kz
    across = math.sqrt(wx * wx + wy * wy + wz * wz)
    ex, ey, ez = (wx / across, wy / across, wz / across) if across > 0.0 else side
    out, up, used = law.cup.pivot(across, above)
    qx, qy, qz = out * ex + up * kx, out * ey + up * ky, out * ez + up * kz
    dx, dy, dz = x - qx, y - qy, z - qz
    left = math.sqrt(dx * dx + dy * dy + dz * dz)
    if used + left <= law.length_m or left == 0.0:
        return None
    lean = out * (axis_rate[0] * ex + axis_rate[1] * ey + axis_rate[2] * ez)
    vx = ball_m_s[0] - (up * axis_rate[0] - lean * kx)
    vy = ball_m_s[1] - (up * axis_rate[1] - lean * ky)
    vz = ball_m_s[2] - (up * axis_rate[2] - lean * kz)
    growth = (dx * vx + dy * vy + dz * vz) / left
    pull = law.stiffness_n_m * (used + left - law.length_m) + law.damping_n_s_m * growth
    if pull <= 0.0:
        return None
    k = -pull / left
    return RopePull((k * dx, k * dy, k * dz), (qx, qy, qz))


def _pull_from_side(
    law: RopeLaw, ball_m: Vector, ball_m_s: Vector, frame: tuple[Vector, Vector, Vector], spin: float
) -> RopePull | None:
    """``rope_pull`` with the tie on the wall; ``frame`` is the axis, its rate, and the side of the tie."""
    axis, axis_rate, side = frame
    cup, aside = law.cup, _cross(axis, side)
    seen = _dot(ball_m, side), _dot(ball_m, aside), _dot(ball_m, axis)
    x, y, z, used = side_way(cup.radius_m, cup.rim_m, cup.side_m, seen)
    px, py, pz = (x * one + y * two + z * three for one, two, three in zip(side, aside, axis, strict=True))
    free = ball_m[0] - px, ball_m[1] - py, ball_m[2] - pz
    left = math.hypot(*free)
    if used + left <= law.length_m or left == 0.0:
        return None
    across = _cross(axis, axis_rate)
    carried = _cross((across[0] + spin * axis[0], across[1] + spin * axis[1], across[2] + spin * axis[2]), (px, py, pz))
    growth = (_dot(free, ball_m_s) - _dot(free, carried)) / left
    pull = law.stiffness_n_m * (used + left - law.length_m) + law.damping_n_s_m * growth
    if pull <= 0.0:
        return None
    k = -pull / left
    return RopePull((k * free[0], k * free[1], k * free[2]), (px, py, pz))


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
