"""Computed torque and what the motors make of it, compiled. Arrays (n,) have one value per joint."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.artifacts.friction_model import dry_friction
from kendama_cli.robot_model.friction import direction
from kendama_cli.simulation.dart.drive_kernel import MEAN, POSITION, clipped, follow
from kendama_cli.system.compiled import READ, READ_2D, WRITE, WRITE_2D, Array, boolean, compiled_as, int64

COULOMB, STRIBECK, PER_SPEED, VISCOUS, EFFORT = range(5)
"""Rows of the joints' constants (5, n): Fc, Fs, 1 / vs, b, the motors' limits."""
FINE, LIMITED, NOT_FINITE, NEAR, LOST, GONE = 0, 1, 2, 4, 8, 16
"""Answers of a step, the bits of an integer."""


@compiled_as(int64(READ, READ, READ, READ, READ, READ, WRITE_2D, READ_2D, READ, READ_2D, READ, WRITE))
def computed_torque(  # noqa: PLR0917
    position: Array,
    velocity: Array,
    acceleration: Array,
    noise: Array,
    position_rad: Array,
    velocity_rad_s: Array,
    state: Array,
    limits: Array,
    gains: Array,
    inertia: Array,
    bias: Array,
    torque: Array,
) -> int:
    """Compute the ``torque`` that ArmWorld's law commands without friction, by ``inertia`` H and ``bias`` C q' + g.

    ``gains`` are Kp, Kd and the period; errors are those before the drive moves on. A reference that is not finite lets
    the drive brake, and its joint's answer is not finite.
    """
    kp, kd, period = gains
    n = torque.size
    errors, wanted = np.empty(n), np.empty(n)
    for i in range(n):
        errors[i] = kd * (state[MEAN, i] - velocity_rad_s[i])
        errors[i] += kp * (state[POSITION, i] - position_rad[i] - noise[i])
    answer = LIMITED if follow(position, velocity, acceleration, state, limits, period, wanted) else FINE
    for i in range(n):
        wanted[i] += errors[i]
    for i in range(n):
        torque[i] = bias[i]
        for j in range(n):
            torque[i] += inertia[i, j] * wanted[j]
        if not math.isfinite(torque[i] + position[i] + velocity[i] + acceleration[i]):
            torque[i] = math.nan
            answer |= NOT_FINITE
    return answer


@compiled_as(boolean(READ, READ, READ, READ, READ_2D, READ, WRITE, WRITE))
def efforts(  # noqa: PLR0917
    torque: Array,
    added: Array,
    velocity_rad_s: Array,
    wanted_rad_s: Array,
    joints: Array,
    unknown: Array,
    effort: Array,
    level: Array,
) -> bool:
    """Compute the motors' efforts for ``torque``, and friction's limit; return False if ``torque`` is not finite.

    ``effort`` is the torque with the compensation of the known friction for the speeds ``wanted_rad_s`` and what is
    ``added``, within the motors' limits; ``level`` the dry friction of every joint. ``unknown`` is the factor on all
    friction and the Coulomb friction beyond it.
    """
    factor, extra = unknown
    finite = True
    for i in range(torque.size):
        ratio = wanted_rad_s[i] * joints[PER_SPEED, i]
        dry = dry_friction(joints[COULOMB, i], joints[STRIBECK, i], ratio)
        known = dry * direction(wanted_rad_s[i]) + joints[VISCOUS, i] * velocity_rad_s[i]
        given = torque[i] + known + added[i]
        effort[i] = given
        if math.isfinite(given):
            effort[i] = clipped(given, -joints[EFFORT, i], joints[EFFORT, i])
        else:
            finite = False
        ratio = velocity_rad_s[i] * joints[PER_SPEED, i]
        level[i] = factor * dry_friction(joints[COULOMB, i], joints[STRIBECK, i], ratio) + extra
    return finite


@compiled_as(
    int64(READ, READ, READ, READ, READ, READ, READ, WRITE_2D, READ_2D, READ, READ_2D, READ, READ_2D, READ, WRITE, WRITE)
)
def command(  # noqa: PLR0917
    position: Array,
    velocity: Array,
    acceleration: Array,
    noise: Array,
    added: Array,
    position_rad: Array,
    velocity_rad_s: Array,
    state: Array,
    limits: Array,
    gains: Array,
    joints: Array,
    unknown: Array,
    inertia: Array,
    bias: Array,
    effort: Array,
    level: Array,
) -> int:
    """Compute ``computed_torque`` and what the motors make of it (``efforts``)."""
    torque = np.empty(effort.size)
    answer = computed_torque(
        position,
        velocity,
        acceleration,
        noise,
        position_rad,
        velocity_rad_s,
        state,
        limits,
        gains,
        inertia,
        bias,
        torque,
    )
    if not efforts(torque, added, velocity_rad_s, state[MEAN], joints, unknown, effort, level):
        answer |= NOT_FINITE
    return answer
