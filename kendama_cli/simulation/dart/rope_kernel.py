"""The forces of rope and air on the ball, compiled: the law of physics.rope over plain arrays.

All compiled code of the ball lives in this one file, because numba's cache of a function notices changes in its own
file only.
"""

from __future__ import annotations

import math
from typing import Any

from numba import boolean, float64, njit, types

from kendama_cli.physics.rope import RopeLaw

Array = Any
"""A numpy array of float64; compiled code takes no finer annotation."""
FAR_AWAY = 1e4
"""A ball farther away or faster than this, in m and m/s, has left the domain of the model."""
READ = types.Array(float64, 1, "A", readonly=True)
WRITE = float64[::1]

TENSION, REACTION, PIVOT, SIDE = 3, 4, 7, 10
"""Where in ``pulled`` (13,) these begin: the rope's force on the ball (3), its size, the opposite force on the cup (3)
and where in the world it acts (3), and the direction (3) in which the rope last left the cup's axis."""


def constants(law: RopeLaw) -> list[float]:
    """Those of the rope and the cup that it goes round, as ``pull`` takes them before the air's."""
    cup = law.cup
    sizes = [cup.radius_m, cup.floor_m, cup.rim_m, cup.handle_m, *cup.used_m]
    return [law.length_m, law.stiffness_n_m, law.damping_n_s_m, *sizes]


@njit(types.void(READ, float64, float64, WRITE), cache=True, error_model="numpy")
def air(ball_m_s: Array, k1: float, k2: float, force: Array) -> None:
    """The drag -(k1 + k2 |v|) v on the ball into ``force`` (3,)."""
    vx, vy, vz = ball_m_s
    drag = k1 + k2 * math.sqrt(vx * vx + vy * vy + vz * vz)
    force[0], force[1], force[2] = -drag * vx, -drag * vy, -drag * vz


@njit(boolean(READ, READ, READ, READ, READ, READ, READ, WRITE, WRITE), cache=True, error_model="numpy")
def pull(  # noqa: PLR0917 - plain numbers and arrays, as compiled code takes them
    ball_m: Array,
    ball_m_s: Array,
    tie_m: Array,
    tie_m_s: Array,
    up_m: Array,
    up_m_s: Array,
    rope: Array,
    pulled: Array,
    force: Array,
) -> bool:
    """Put the rope's pull (physics.rope.rope_pull) into ``pulled`` and its sum with the drag into ``force`` (3,).

    ``up_m`` and ``up_m_s`` (3,) are place and velocity of a point of the cup on its axis, over the tie; ``rope`` holds
    the ``constants``, the drag k1, k2 and the height of that point. False where the ball has gone far away.
    """
    length_m, stiffness_n_m, damping_n_s_m, radius, floor, rim, handle, at_edge, at_floor, at_rim, k1, k2, high = rope
    kx, ky, kz = (up_m[0] - tie_m[0]) / high, (up_m[1] - tie_m[1]) / high, (up_m[2] - tie_m[2]) / high
    x, y, z = ball_m[0] - tie_m[0], ball_m[1] - tie_m[1], ball_m[2] - tie_m[2]
    vx, vy, vz = ball_m_s[0] - tie_m_s[0], ball_m_s[1] - tie_m_s[1], ball_m_s[2] - tie_m_s[2]
    above = x * kx + y * ky + z * kz
    used = out = up = 0.0
    if above > 0.0:
        wx, wy, wz = x - above * kx, y - above * ky, z - above * kz
        across = math.sqrt(wx * wx + wy * wy + wz * wz)
        if across > 0.0:
            pulled[SIDE], pulled[SIDE + 1], pulled[SIDE + 2] = wx / across, wy / across, wz / across
        ex, ey, ez = pulled[SIDE], pulled[SIDE + 1], pulled[SIDE + 2]
        if above > floor and across < radius:
            used, out, up = at_rim, radius, rim
        elif above > floor and (radius - handle) * above > floor * (across - handle):
            used, out, up = at_floor, radius, floor
        else:
            used, out = at_edge, handle
        tx, ty, tz = (up_m_s[0] - tie_m_s[0]) / high, (up_m_s[1] - tie_m_s[1]) / high, (up_m_s[2] - tie_m_s[2]) / high
        lean = out * (tx * ex + ty * ey + tz * ez)
        vx, vy, vz = vx - (up * tx - lean * kx), vy - (up * ty - lean * ky), vz - (up * tz - lean * kz)
        qx, qy, qz = out * ex + up * kx, out * ey + up * ky, out * ez + up * kz
        x, y, z = x - qx, y - qy, z - qz
        pulled[PIVOT], pulled[PIVOT + 1], pulled[PIVOT + 2] = tie_m[0] + qx, tie_m[1] + qy, tie_m[2] + qz
    else:
        pulled[PIVOT], pulled[PIVOT + 1], pulled[PIVOT + 2] = tie_m[0], tie_m[1], tie_m[2]
    left = math.sqrt(x * x + y * y + z * z)
    k = 0.0
    if used + left > length_m and left > 0.0:
        size = stiffness_n_m * (used + left - length_m) + damping_n_s_m * (x * vx + y * vy + z * vz) / left
        if size > 0.0:
            k = -size / left
    fx, fy, fz = k * x, k * y, k * z
    pulled[0], pulled[1], pulled[2], pulled[TENSION] = fx, fy, fz, math.sqrt(fx * fx + fy * fy + fz * fz)
    pulled[REACTION], pulled[REACTION + 1], pulled[REACTION + 2] = -fx, -fy, -fz
    air(ball_m_s, k1, k2, force)
    extent = 0.0
    for i in range(3):
        force[i] += pulled[i]
        extent += abs(ball_m[i]) + abs(ball_m_s[i])
    return bool(extent < FAR_AWAY)
