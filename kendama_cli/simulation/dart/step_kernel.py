"""All forces of a step of an arm with a ball, compiled, and what may touch in it; (n,) has one value per joint."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.simulation.dart.drive_kernel import FASTEST, LOWER, UPPER
from kendama_cli.simulation.dart.dynamics_kernel import OVER, ROTOR, TIE, carry_rotors, move_chain
from kendama_cli.simulation.dart.rope_kernel import (
    GRAVITY,
    HEIGHT,
    MASS,
    PIVOT,
    REACTION,
    SIDE,
    TENSION,
    pull,
    pull_else,
)
from kendama_cli.simulation.dart.torque_kernel import (
    FINE,
    GONE,
    LOST,
    NEAR,
    NOT_FINITE,
    VISCOUS,
    accelerations,
    command,
)
from kendama_cli.system.compiled import (
    NONE,
    READ,
    READ_2D,
    WRITE,
    WRITE_2D,
    Array,
    boolean,
    compiled_as,
    float64,
    int64,
)

NEAR_M, NEAR_S, NEAR_RAD, NEAR_SPEED = 0.02, 0.002, 0.02, 0.9
"""In one step of 1 ms no part of an arm comes nearer than the first to a ball that stands, a moving ball in addition no
nearer than its way in the second; no joint goes farther than the third, or from the fourth of its top speed to all."""
BEFORE, GIVEN, LAST, PRESSED = 3, 6, 9, 12
"""Offsets in what is known of the ball's touch (13,), after the force (3,) with which it presses: its velocity before
the last step, the force of rope and air in that step, the force of the step before; and 1 if DART made that step."""


@compiled_as(float64(READ, READ, READ))
def _distance(point: Array, start: Array, end: Array) -> float:
    """Return the distance from ``point`` to the segment between ``start`` and ``end``, all (3,)."""
    along = square = 0.0
    for r in range(3):
        along += (point[r] - start[r]) * (end[r] - start[r])
        square += (end[r] - start[r]) ** 2
    fraction = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    gap = 0.0
    for r in range(3):
        gap += (point[r] - start[r] - fraction * (end[r] - start[r])) ** 2
    return math.sqrt(gap)


@compiled_as(float64(READ))
def _margin(ball_m_s: Array) -> float:
    """Return the distance that cannot be crossed within the next step."""
    return NEAR_M + NEAR_S * float(abs(ball_m_s[0]) + abs(ball_m_s[1]) + abs(ball_m_s[2]))


@compiled_as(boolean(READ, READ, READ_2D, READ))
def _is_by_cup(ball_m: Array, ball_m_s: Array, points: Array, radii: Array) -> bool:
    """Return True if ball and cup may touch within the next step."""
    cup = radii.size - 1
    return bool(_distance(ball_m, points[cup], points[cup]) < radii[cup] + _margin(ball_m_s))


@compiled_as(boolean(READ, READ, READ, READ, READ_2D, READ, READ_2D))
def _is_near(  # noqa: PLR0917
    position_rad: Array,
    velocity_rad_s: Array,
    ball_m: Array,
    ball_m_s: Array,
    points: Array,
    radii: Array,
    limits: Array,
) -> bool:
    """Return True if ball and arm may touch within the next step, or a joint reach a stop or its top velocity.

    ``radii`` are those of the capsules between one of the ``points`` of the arm and the next, and last of the ball that
    holds the cup about the last point; the ball's own is in each. Negative: there is no such part.
    """
    for i in range(position_rad.size):
        q, v = position_rad[i], velocity_rad_s[i]
        if (
            not limits[LOWER, i] + NEAR_RAD < q < limits[UPPER, i] - NEAR_RAD
            or abs(v) > NEAR_SPEED * limits[FASTEST, i]
        ):
            return True
    if _is_by_cup(ball_m, ball_m_s, points, radii):
        return True
    margin = _margin(ball_m_s)
    for i in range(radii.size - 1):
        if radii[i] >= 0.0 and _distance(ball_m, points[i], points[i + 1]) < radii[i] + margin:
            return True
    return False


@compiled_as(
    int64(
        READ, READ, READ, READ, READ, READ, READ, READ, READ, READ_2D, READ_2D, READ, READ, READ_2D, READ, READ_2D,
        READ_2D, float64, float64, WRITE, WRITE,
    )
)  # fmt: skip
def joint_forces(  # noqa: PLR0917
    position_rad: Array,
    velocity_rad_s: Array,
    effort: Array,
    level: Array,
    ball_m: Array,
    ball_m_s: Array,
    reaction_n: Array,
    pivot_m: Array,
    touch_n: Array,
    screws: Array,
    inertia: Array,
    rotor: Array,
    bias: Array,
    points: Array,
    radii: Array,
    joints: Array,
    limits: Array,
    factor: float,
    period: float,
    force: Array,
    change: Array,
) -> int:
    """Compute the joints' ``change`` of velocity per second in the coming step, and for DART the ``force`` on them.

    It is that of the motors, of dry friction, and the rope's.

        (H + T B) (v' - v) = T (effort + friction + J^T F + J^T D - C v - g - B v)

    as DART steps, with the viscous friction B implicit; F = ``reaction_n`` pulls at ``pivot_m``, and the friction is
    that with which v' obeys Coulomb's law (``held``). D = ``touch_n`` is how the ball has pressed on the cup so far: it
    is in no ``force``, because DART finds it anew, but a joint rests under it. H has the ``rotor`` on its diagonal, and
    ``force`` what ``carry_rotors`` adds for DART. ``factor`` is that on all friction, ``period`` T. The answer is FINE,
    or NEAR where something may touch in that step (see _is_near), or LOST where the inertia has no factor, or no
    friction was found.
    """
    n = effort.size
    load, viscous, friction = np.empty(n), np.empty(n), np.empty(n)
    # beside the cup the ball presses on a link, which the joints behind do not feel
    pressed = 1.0 if _is_by_cup(ball_m, ball_m_s, points, radii) else 0.0
    for i in range(n):
        viscous[i] = factor * joints[VISCOUS, i]
        pulled = reaction_n[0] * (screws[i, 1] * pivot_m[2] - screws[i, 2] * pivot_m[1] + screws[i, 3])
        pulled += reaction_n[1] * (screws[i, 2] * pivot_m[0] - screws[i, 0] * pivot_m[2] + screws[i, 4])
        pulled += reaction_n[2] * (screws[i, 0] * pivot_m[1] - screws[i, 1] * pivot_m[0] + screws[i, 5])
        force[i] = effort[i] + pulled
        load[i] = force[i] - bias[i] - viscous[i] * velocity_rad_s[i]
        load[i] += pressed * touch_n[0] * (screws[i, 1] * ball_m[2] - screws[i, 2] * ball_m[1] + screws[i, 3])
        load[i] += pressed * touch_n[1] * (screws[i, 2] * ball_m[0] - screws[i, 0] * ball_m[2] + screws[i, 4])
        load[i] += pressed * touch_n[2] * (screws[i, 0] * ball_m[1] - screws[i, 1] * ball_m[0] + screws[i, 5])
    if not accelerations(inertia, viscous, velocity_rad_s, load, level, period, friction, change):
        return LOST
    if not _is_near(position_rad, velocity_rad_s, ball_m, ball_m_s, points, radii, limits):
        return FINE
    for i in range(n):
        force[i] += friction[i]
    carry_rotors(screws, velocity_rad_s, change, rotor, force)
    return NEAR


@compiled_as(NONE(READ, READ, float64, WRITE))
def press(ball_m_s: Array, numbers: Array, period: float, touch: Array) -> None:
    """Infer the force of ``touch`` (3,) with which a ball presses on what it touches from its velocity v' after a step.

        force = given + m g - m (v' - v) / T

    Of the last two steps it is the smaller one, so that an impact, which is over, does not count.
    """
    if touch[PRESSED] == 0.0:
        return
    square = last_square = 0.0
    for r in range(3):
        last, weight = touch[LAST + r], numbers[MASS] * numbers[GRAVITY] if r == 2 else 0.0
        now = touch[GIVEN + r] - weight - numbers[MASS] / period * (ball_m_s[r] - touch[BEFORE + r])
        touch[r], touch[LAST + r] = last, now
        square, last_square = square + now * now, last_square + last * last
    if square < last_square:
        touch[:3] = touch[LAST:PRESSED]


@compiled_as(
    int64(
        READ, READ, READ, READ, READ, READ, READ, READ, READ, WRITE, WRITE, READ_2D, READ_2D, READ_2D, READ_2D, READ,
        READ, READ, READ, READ, WRITE_2D, WRITE, WRITE, WRITE, WRITE, WRITE, WRITE_2D, WRITE, WRITE_2D, WRITE_2D,
        WRITE_2D,
    )
)  # fmt: skip
def step_forces(  # noqa: PLR0917
    position: Array,
    velocity: Array,
    acceleration: Array,
    noise: Array,
    added: Array,
    position_rad: Array,
    velocity_rad_s: Array,
    ball_m: Array,
    ball_m_s: Array,
    effort: Array,
    after: Array,
    links: Array,
    marks: Array,
    limits: Array,
    joints: Array,
    radii: Array,
    gains: Array,
    unknown: Array,
    rope: Array,
    numbers: Array,
    state: Array,
    level: Array,
    pulled: Array,
    ball_force: Array,
    force: Array,
    touch: Array,
    inertia: Array,
    bias: Array,
    screws: Array,
    points: Array,
    speeds: Array,
) -> int:
    """Find all forces of a step and, where nothing can touch in it, make the step: else DART does.

        v' = v + T q'',   q' = q + T v'

    ``after`` (3 n + 6,) is then q', v' and q'' of the joints, and place and velocity of the ball. GONE where the ball
    has gone far away; nothing is done after that, nor after NOT_FINITE or LOST. ``links`` (n, 20) and ``marks``
    (4 or 5, 3) are those of ArmArrays, ``limits`` (6, n) and ``joints`` (5, n) of Drive and JointFriction, ``radii``
    (n + 2,) of _is_near; ``gains`` are Kp, Kd, T and gravity, ``unknown`` the factor on all friction and the Coulomb
    friction beyond it, ``rope`` (13,) or (14,) and ``numbers`` (6,) those of rope_kernel. The rest is written: the
    drive's ``state`` (3, n), the ``level`` of dry friction, what the rope does, ``pulled`` (13,) and ``ball_force``
    (3,), the joints' ``force`` for DART, ``touch`` (13,), and from ``inertia`` on what move_chain found for the present
    state, in the end for the next.
    """
    n, period = position_rad.size, gains[2]
    press(ball_m_s, numbers, period, touch)
    tie, tie_speed = points[n + TIE], speeds[TIE]
    # after the point on the axis, a tie on the wall
    over, over_speed = points[n + OVER :].copy().reshape(-1), speeds[OVER:].copy().reshape(-1)
    for r in range(3):
        over[r] = tie[r] + rope[HEIGHT] * (over[r] - tie[r])
        over_speed[r] = tie_speed[r] + rope[HEIGHT] * (over_speed[r] - tie_speed[r])
    if not pull(ball_m, ball_m_s, tie, tie_speed, over, over_speed, rope, pulled, ball_force):
        return GONE
    pull_else(ball_m, ball_m_s, tie, tie_speed, pulled[TENSION], numbers, ball_force)
    answer = command(
        position, velocity, acceleration, noise, added, position_rad, velocity_rad_s, state, limits, gains[:3], joints,
        unknown, inertia, bias, effort, level,
    )  # fmt: skip
    if answer & NOT_FINITE:
        return answer
    change = after[2 * n : 3 * n]
    answer |= joint_forces(
        position_rad, velocity_rad_s, effort, level, ball_m, ball_m_s, pulled[REACTION:PIVOT], pulled[PIVOT:SIDE],
        touch[:3], screws, inertia, links[:, ROTOR], bias, points[: n + TIE], radii, joints, limits, unknown[0], period,
        force, change,
    )  # fmt: skip
    if answer & NEAR:
        touch[BEFORE:GIVEN], touch[GIVEN:LAST], touch[PRESSED] = ball_m_s, ball_force, 1.0
    elif not answer & LOST:
        touch[:] = 0.0
        for i in range(n):
            after[n + i] = velocity_rad_s[i] + period * change[i]
            after[i] = position_rad[i] + period * after[n + i]
        for r in range(3):
            fall = numbers[GRAVITY] if r == 2 else 0.0
            after[3 * n + 3 + r] = ball_m_s[r] + period * (ball_force[r] / numbers[MASS] - fall)
            after[3 * n + r] = ball_m[r] + period * after[3 * n + 3 + r]
        move_chain(after[:n], after[n : 2 * n], links, marks, gains[3], inertia, bias, screws, points, speeds)
    return answer
