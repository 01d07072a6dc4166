"""Rope and air on the ball in the world, compiled."""

from __future__ import annotations

import math

from kendama_cli.physics.free_fall import drag_n
from kendama_cli.physics.rope import CupProfile, RopeLaw, rope_pull
from kendama_cli.system.compiled import NONE, READ, WRITE, Array, boolean, compiled, compiled_as, float64

TENSION, REACTION, PIVOT, SIDE = 3, 4, 7, 10
"""Offsets in ``pulled`` (13,): the rope's force on the ball (3), its size, the opposite force on the cup (3)
and where in the world it acts (3), and the direction (3) in which the rope last left the cup's axis."""
MASS, GRAVITY, RUBBING, LEANING = range(4)
"""Offsets in the ball's numbers (6,): its mass, gravity, the tie's friction over the rope's length, and the force (3,)
by which gravity leans."""
RUBS_FULLY_M_S = 0.02
"""Coulomb friction at the tie is smoothed below this speed of the ball across the rope."""
FAR_AWAY = 1e4
"""A ball farther away or faster than this, in m and m/s, has left the domain of the model."""
HEIGHT, ON_WALL = 12, 13
"""Offsets in the rope's numbers: the height over the cup's position at which the cup's axis is taken, and, with a tie
on
the wall, that tie's height."""


def rope_constants(law: RopeLaw) -> list[float]:
    """Return those of the rope and the cup that it goes round, as ``pull`` takes them before the air's.

    With a tie on the wall its height follows after the rest (ON_WALL).
    """
    cup = law.cup
    sizes = [cup.radius_m, cup.floor_m, cup.rim_m, cup.handle_m, *cup.used_m]
    return [law.length_m, law.stiffness_n_m, law.damping_n_s_m, *sizes]


@compiled_as(NONE(READ, float64, float64, WRITE))
def air(ball_m_s: Array, k1: float, k2: float, force: Array) -> None:
    """Put the drag on the ball into ``force`` (3,)."""
    force[0], force[1], force[2] = drag_n(k1, k2, (ball_m_s[0], ball_m_s[1], ball_m_s[2]))


@compiled
def _between(end: Array, first: int, start: Array) -> tuple[float, float, float]:
    """Return the numbers of ``end`` from ``first`` on less those of ``start`` (3,)."""
    return end[first] - start[0], end[first + 1] - start[1], end[first + 2] - start[2]


@compiled
def _over(path: tuple[float, float, float], length: float) -> tuple[float, float, float]:
    return path[0] / length, path[1] / length, path[2] / length


@compiled
def _toward_knot(up: Array, tie: Array, axis: tuple[float, float, float], rope: Array) -> tuple[float, float, float]:
    """Return the direction across the axis to a tie on the wall, or its rate; see ``pull`` for ``up``."""
    x, y, z = _between(up, 3, tie)
    knot = rope[ON_WALL]
    return _over((x - knot * axis[0], y - knot * axis[1], z - knot * axis[2]), rope[3])


@compiled_as(boolean(READ, READ, READ, READ, READ, READ, READ, WRITE, WRITE))
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
    """Put the rope's tension (physics.rope.rope_pull) into ``pulled`` and its sum with the drag into ``force`` (3,).

    ``up_m`` and ``up_m_s`` (3,) are those of a point of the cup on its axis, over the tie; ``rope`` holds
    the ``rope_constants``, the drag k1, k2 and the height of that point. With a tie on the wall ``rope`` has its height
    too, ``tie_m`` is the place under it on the axis, and ``up_m`` and ``up_m_s`` (6,) go on with those of the tie.
    False where the ball has gone far away.
    """
    is_on_wall = rope.size > ON_WALL
    used = rope[7], rope[8], rope[9]
    cup = CupProfile(rope[3], rope[4], rope[5], rope[6], used, rope[ON_WALL] if is_on_wall else 0.0)
    axis, axis_rate = _over(_between(up_m, 0, tie_m), rope[HEIGHT]), _over(_between(up_m_s, 0, tie_m_s), rope[HEIGHT])
    side, side_rate = (pulled[SIDE], pulled[SIDE + 1], pulled[SIDE + 2]), (0.0, 0.0, 0.0)
    if is_on_wall:
        side, side_rate = _toward_knot(up_m, tie_m, axis, rope), _toward_knot(up_m_s, tie_m_s, axis_rate, rope)
    ball, velocity = _between(ball_m, 0, tie_m), _between(ball_m_s, 0, tie_m_s)
    law = RopeLaw(rope[0], rope[1], rope[2], cup)
    found = rope_pull(law, ball, velocity, axis, axis_rate, side, side_rate)
    air(ball_m_s, rope[10], rope[11], force)
    extent, pulled[TENSION] = 0.0, found.tension_n
    for r in range(3):
        pulled[r], pulled[REACTION + r] = found.force_n[r], -found.force_n[r]
        pulled[PIVOT + r], pulled[SIDE + r] = tie_m[r] + found.pivot_m[r], found.side[r]
        force[r] += pulled[r]
        extent += abs(ball_m[r]) + abs(ball_m_s[r])
    return bool(extent < FAR_AWAY)


@compiled_as(NONE(READ, READ, READ, READ, float64, READ, WRITE))
def pull_else(  # noqa: PLR0917
    ball_m: Array,
    ball_m_s: Array,
    tie_m: Array,
    tie_m_s: Array,
    tension_n: float,
    numbers: Array,
    force: Array,
) -> None:
    """Add to ``force`` (3,) the lean of gravity and the rope's Coulomb friction about its tie, across the rope."""
    path, motion = _between(ball_m, 0, tie_m), _between(ball_m_s, 0, tie_m_s)
    length = max(math.sqrt(path[0] ** 2 + path[1] ** 2 + path[2] ** 2), 1e-9)
    along = (path[0] * motion[0] + path[1] * motion[1] + path[2] * motion[2]) / length**2
    x, y, z = motion[0] - along * path[0], motion[1] - along * path[1], motion[2] - along * path[2]
    size = numbers[RUBBING] * tension_n / (math.sqrt(x * x + y * y + z * z) + RUBS_FULLY_M_S)
    force[0] += numbers[LEANING] - size * x
    force[1] += numbers[LEANING + 1] - size * y
    force[2] += numbers[LEANING + 2] - size * z
