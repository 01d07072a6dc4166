"""All forces of a step of an arm with a ball, compiled, and what may touch in it; (n,) has one value per joint."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kendama_cli.simulation.dart.drive_kernel import FASTEST, LOWER, UPPER
from kendama_cli.simulation.dart.dynamics_kernel import ROTOR, carry_rotors, move_chain
from kendama_cli.simulation.dart.rope_kernel import HEIGHT, PIVOT, REACTION, SIDE, pull
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
from kendama_cli.system.compiled import READ, READ_2D, WRITE, WRITE_2D, Array, boolean, compiled_as, float64, int64

NEAR_M, NEAR_S, NEAR_RAD, NEAR_SPEED = 0.02, 0.002, 0.02, 0.9
"""In one step of 1 ms no part of an arm comes nearer than the first to a ball that stands, a moving ball in addition no
nearer than its way in the second; no joint goes farther than the third, or from the fourth of its top speed to all."""
ROOT, MIDDLE, TIE, OVER, KNOT = range(5)
"""Marks on the last link: its joint's origin, the cup's middle, its position (the tie, if on the axis), the point of
the axis 1 m over it, and a tie on the wall."""


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
        READ_2D, float64, float64, WRITE,
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
) -> int:
    """Compute the ``force`` on the joints in the coming step: of the motors, of dry friction, and the rope's.

        (H + T B) (v' - v) = T (effort + friction + J^T F + J^T D - C v - g - B v)

    as DART steps, with the viscous friction B implicit; F = ``reaction_n`` pulls at ``pivot_m``, and the friction is
    that with which v' obeys Coulomb's law (``held``). D = ``touch_n`` is how the ball has pressed on the cup so far: it
    is in no ``force``, because DART finds it anew, but a joint rests under it. H has the ``rotor`` on its diagonal, and
    ``force`` what ``carry_rotors`` adds for DART. ``factor`` is that on all friction, ``period`` T. The answer is FINE,
    or NEAR where something may touch in that step (see _is_near), or LOST where the inertia has no factor, or no
    friction was found.
    """
    n = effort.size
    load, viscous, friction, change = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
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
    for i in range(n):
        force[i] += friction[i]
    carry_rotors(screws, velocity_rad_s, change, rotor, force)
    return NEAR if _is_near(position_rad, velocity_rad_s, ball_m, ball_m_s, points, radii, limits) else FINE


class StepArrays(NamedTuple):
    """Arrays of an arm of n joints with a ball that stay the same objects from reset to reset.

    ``step_forces`` takes them one by one, in this order: a tuple takes 1.4 us longer to hand over, 6 % of a step.
    """

    links: Array
    """(n, 20), columns AXIS and so on"""
    marks: Array
    """(4 or 5, 3) points of the last link: ROOT and so on"""
    limits: Array
    """(6, n), rows LOWER and so on"""
    joints: Array
    """(5, n), rows COULOMB and so on"""
    radii: Array
    """(n + 2,) of what the ball's centre may come near to, see _is_near"""
    gains: Array
    """(4,): Kp, Kd, the period and gravity"""
    unknown: Array
    """(2,): the factor on all friction, and the Coulomb friction beyond it"""
    rope: Array
    """(13,), with a tie on the wall (14,), see rope_kernel.pull"""
    state: Array
    """(3, n), the drive's, rows POSITION and so on; written"""
    level: Array
    """(n,) the dry friction; written"""
    pulled: Array
    """(13,) what the rope does, see TENSION; written"""
    ball_force: Array
    """(3,) on the ball; written"""
    force: Array
    """(n,) on the joints; written"""


@compiled_as(
    int64(
        READ, READ, READ, READ, READ, READ, READ, READ, READ, READ, WRITE, READ_2D, READ_2D, READ_2D, READ_2D, READ,
        READ, READ, READ, WRITE_2D, WRITE, WRITE, WRITE, WRITE,
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
    touch_n: Array,
    effort: Array,
    links: Array,
    marks: Array,
    limits: Array,
    joints: Array,
    radii: Array,
    gains: Array,
    unknown: Array,
    rope: Array,
    state: Array,
    level: Array,
    pulled: Array,
    ball_force: Array,
    force: Array,
) -> int:
    """Find all forces of a step: ``move_chain``, ``pull``, ``command``, ``joint_forces`` in one.

    After the arrays of the step come those of StepArrays. GONE where the ball has gone far away; nothing is done after
    that, nor after NOT_FINITE.
    """
    n = position_rad.size
    inertia, bias, screws = np.empty((n, n)), np.empty(n), np.empty((n, 6))
    points, speeds = np.empty((n + marks.shape[0], 3)), np.empty((marks.shape[0], 3))
    move_chain(position_rad, velocity_rad_s, links, marks, gains[3], inertia, bias, screws, points, speeds)
    tie, tie_speed = points[n + TIE], speeds[TIE]
    # after the point on the axis, a tie on the wall
    over, over_speed = points[n + OVER :].copy().reshape(-1), speeds[OVER:].copy().reshape(-1)
    for r in range(3):
        over[r] = tie[r] + rope[HEIGHT] * (over[r] - tie[r])
        over_speed[r] = tie_speed[r] + rope[HEIGHT] * (over_speed[r] - tie_speed[r])
    if not pull(ball_m, ball_m_s, tie, tie_speed, over, over_speed, rope, pulled, ball_force):
        return GONE
    answer = command(
        position, velocity, acceleration, noise, added, position_rad, velocity_rad_s, state, limits, gains[:3], joints,
        unknown, inertia, bias, effort, level,
    )  # fmt: skip
    if answer & NOT_FINITE:
        return answer
    return answer | joint_forces(
        position_rad, velocity_rad_s, effort, level, ball_m, ball_m_s, pulled[REACTION:PIVOT], pulled[PIVOT:SIDE],
        touch_n, screws, inertia, links[:, ROTOR], bias, points[: n + TIE], radii, joints, limits, unknown[0], gains[2],
        force,
    )  # fmt: skip
