"""The rope round the cup: its shortest way from tie point to ball, and its force (equations.md eq. 1)."""

from __future__ import annotations

import math
from typing import NamedTuple

from kendama_cli.physics.side_rope import side_path
from kendama_cli.settings.game import CupSettings, GameSettings, HandleTie, SideTie

Vector = tuple[float, float, float]


class CupProfile(NamedTuple):
    """The cup as the rope goes round it: solid, round about the axis, the tie on the axis at the height 0.

    A handle of ``handle_m`` radius up to ``floor_m``, then the cup of ``radius_m`` up to ``rim_m``; without a handle
    ``handle_m`` is the cup's radius and ``floor_m`` is 0. ``used_m`` is the rope from the tie to the three edges.
    With ``side_m`` above 0 the tie is on the wall at that height over the floor, on which the cup's position is.
    """

    radius_m: float
    floor_m: float
    rim_m: float
    handle_m: float
    used_m: tuple[float, float, float]
    side_m: float = 0.0

    @classmethod
    def of(cls, cup: CupSettings) -> CupProfile:
        """Return the profile of a cup."""
        r, floor, rim = cup.outer_radius_m, cup.floor_m, cup.rim_m
        if isinstance(cup.tie, SideTie):
            return cls(r, 0.0, rim, r, (r, r, r + rim), cup.tie_m[2])
        handle = cup.tie.radius_m if isinstance(cup.tie, HandleTie) else r
        at_floor = handle + math.hypot(r - handle, floor)
        return cls(r, floor, rim, handle, (handle, at_floor, at_floor + rim - floor))

    def path_length_m(self, x_m: float, y_m: float, z_m: float) -> float:
        """Return the path length from the tie of an upright cup, on the wall toward +x, to a ball at this position."""
        if self.side_m > 0.0:
            path = side_path(self.radius_m, self.rim_m, self.side_m, (x_m, y_m, z_m))
            return path.used_m + math.dist(path[:3], (x_m, y_m, z_m))
        across = math.hypot(x_m, y_m)
        out, up, used = pivot(self, across, z_m)
        return used + math.hypot(across - out, z_m - up)


def pivot(cup: CupProfile, across_m: float, above_m: float) -> tuple[float, float, float]:
    """Return the last point that the rope touches on its way to a ball ``across_m`` from the axis, and the rope to it.

    Distance from the axis and height over the tie of that point, then the length used, all in the half-plane of axis
    and ball. A frictionless rope takes the shortest way, which turns at convex edges only:

        z <= 0: the tie itself;  z > 0: the lower edge;  beside the rim's circle above the floor: the rim.

    No branch: compiled, many balls are taken at once.
    """
    r, h, floor = cup.radius_m, cup.handle_m, cup.floor_m
    is_above, is_over = above_m > 0.0, above_m > floor
    rim = is_over & (across_m < r)
    edge = is_over & ((r - h) * above_m > floor * (across_m - h))
    out = r if rim | edge else (h if is_above else 0.0)
    up = cup.rim_m if rim else (floor if edge else 0.0)
    used = cup.used_m[2] if rim else (cup.used_m[1] if edge else (cup.used_m[0] if is_above else 0.0))
    return out, up, used


class RopeLaw(NamedTuple):
    """Length [m], stiffness [N/m] and damping [N s/m] of the rope, and the cup that it goes round."""

    length_m: float
    stiffness_n_m: float
    damping_n_s_m: float
    cup: CupProfile

    @classmethod
    def of(cls, game: GameSettings, rope_scale: float = 1.0) -> RopeLaw:
        """Return that of the game, with a rope ``rope_scale`` times as long."""
        rope = game.rope
        return cls(rope.length_m * rope_scale, rope.stiffness_n_m, rope.damping_n_s_m, CupProfile.of(game.cup))


class RopePull(NamedTuple):
    """The rope's force on the ball and its size [N], 0 where it is slack; the opposite acts on the cup at the pivot.

    ``pivot_m`` is from the tie; ``side`` is the direction across the cup's axis in which the rope leaves it.
    """

    force_n: Vector
    tension_n: float
    pivot_m: Vector
    side: Vector


def tension_n(law: RopeLaw, used_m: float, left_m: float, growing_m2_s: float) -> float:
    """Return the pull of a rope of which ``used_m`` lies on the cup and ``left_m`` goes on to the ball.

        f = Ks d + Kd l'  if d > 0 and f > 0, else 0;   d = used + left - l0,  l' = (p - q).(v - w) / left

    ``growing_m2_s`` is (p - q).(v - w), see ``rope_pull``. A rope never pushes: where damping would outweigh the
    spring on the way in, the force is zero. No branch: compiled, many balls are taken at once.
    """
    growth = law.damping_n_s_m * growing_m2_s / left_m if left_m > 0.0 else 0.0
    tension = law.stiffness_n_m * (used_m + left_m - law.length_m) + growth
    return tension if (used_m + left_m > law.length_m) & (left_m > 0.0) & (tension > 0.0) else 0.0


def rope_pull(  # noqa: PLR0917 - vectors one after another, as in the formula
    law: RopeLaw,
    ball_m: Vector,
    ball_m_s: Vector,
    axis: Vector = (0.0, 0.0, 1.0),
    axis_rate: Vector = (0.0, 0.0, 0.0),
    side: Vector = (1.0, 0.0, 0.0),
    side_rate: Vector = (0.0, 0.0, 0.0),
) -> RopePull:
    """Return the pull on a ball at ``ball_m`` from the tie with ``ball_m_s`` relative to it.

    By ``tension_n``, with p the ball, q the last point that the rope touches, both from the tie, n = (p - q) / left and
    w the velocity of the cup's material at q: the force is -f n. The point q slides along the edge without moving the
    length. ``axis`` is the cup's unit axis and ``axis_rate`` its rate: the part of the cup's turning about its own axis
    moves q across n and drops out. On the axis itself the rope lies toward ``side``.

    Where the tie is at the side, ``ball_m`` and ``ball_m_s`` count from the cup's position under it, ``side`` is the
    unit vector across the axis toward the tie, and ``side_rate`` its rate.
    """
    if law.cup.side_m > 0.0:
        return _pull_from_side(law, ball_m, ball_m_s, (axis, axis_rate, side, side_rate))
    (x, y, z), (kx, ky, kz), (tx, ty, tz) = ball_m, axis, axis_rate
    above = _dot(ball_m, axis)
    if above <= 0.0:
        return _along(law, 0.0, (ball_m, ball_m_s), (0.0, 0.0, 0.0), side)
    wx, wy, wz = x - above * kx, y - above * ky, z - above * kz
    across = math.sqrt(wx * wx + wy * wy + wz * wz)
    ex, ey, ez = (wx / across, wy / across, wz / across) if across > 0.0 else side
    out, up, used = pivot(law.cup, across, above)
    lean = out * (tx * ex + ty * ey + tz * ez)
    (vx, vy, vz) = ball_m_s
    velocity = vx - (up * tx - lean * kx), vy - (up * ty - lean * ky), vz - (up * tz - lean * kz)
    q = out * ex + up * kx, out * ey + up * ky, out * ez + up * kz
    return _along(law, used, ((x - q[0], y - q[1], z - q[2]), velocity), q, (ex, ey, ez))


def _pull_from_side(
    law: RopeLaw, ball_m: Vector, ball_m_s: Vector, frame: tuple[Vector, Vector, Vector, Vector]
) -> RopePull:
    """Return ``rope_pull`` with the tie on the wall; ``frame``: the axis, its rate, the tie's side, its rate."""
    (axis, axis_rate, side, side_rate), cup = frame, law.cup
    lateral, one, two = _cross(axis, side), _cross(axis_rate, side), _cross(axis, side_rate)
    aside_rate = one[0] + two[0], one[1] + two[1], one[2] + two[2]
    seen = _dot(ball_m, side), _dot(ball_m, lateral), _dot(ball_m, axis)
    x, y, z, used = side_path(cup.radius_m, cup.rim_m, cup.side_m, seen)
    p = _combined((x, y, z), (side, lateral, axis))
    w = _combined((x, y, z), (side_rate, aside_rate, axis_rate))
    free = ball_m[0] - p[0], ball_m[1] - p[1], ball_m[2] - p[2]
    velocity = ball_m_s[0] - w[0], ball_m_s[1] - w[1], ball_m_s[2] - w[2]
    return _along(law, used, (free, velocity), p, side)


def _along(law: RopeLaw, used_m: float, free: tuple[Vector, Vector], pivot_m: Vector, side: Vector) -> RopePull:
    """Return the pull along the ``free`` part of the rope, from pivot to ball and how fast that changes."""
    (x, y, z), velocity = free
    left = math.sqrt(_dot(free[0], free[0]))
    size = tension_n(law, used_m, left, _dot(free[0], velocity))
    k = -size / left if size > 0.0 else 0.0
    force = k * x, k * y, k * z
    return RopePull(force, math.sqrt(_dot(force, force)), pivot_m, side)


def _combined(parts: Vector, axes: tuple[Vector, Vector, Vector]) -> Vector:
    (x, y, z), (a, b, c) = parts, axes
    return x * a[0] + y * b[0] + z * c[0], x * a[1] + y * b[1] + z * c[1], x * a[2] + y * b[2] + z * c[2]


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
