"""Limiter of a robot's own drive controller: a command never passes the limits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.errors import HardwareError
from kendama_cli.motion import minimum_jerk
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import drive_kernel
from kendama_cli.simulation.dart.drive_kernel import limit_rows

ABSURD_RAD = 1e3
ABSURD_FACTOR = 1e5
"""No commander means a position farther away than ABSURD_RAD, or so many times what a joint's limits allow."""


def limit_command(last: JointCommand, desired: JointCommand, limits: JointLimits, period_s: float) -> JointCommand:
    """Return the command nearest to ``desired`` that can follow ``last`` in one control period within all limits.

    The reference between two commands is the cubic with their positions and velocities. Where that keeps to the limits
    of position, speed and acceleration and leaves room to brake (see Drive), ``desired`` passes unchanged. Otherwise
    its speed is clipped to what can be reached and braked from, then its position to what can be reached with that
    speed. Raises HardwareError for a command that ``check_command`` refuses.
    """
    check_command(desired, limits)
    return nearest_command(last, desired, limits, period_s)


def nearest_command(last: JointCommand, desired: JointCommand, limits: JointLimits, period_s: float) -> JointCommand:
    """Return the same as ``limit_command``, for a command that is known not to be absurd."""
    begin, end = (np.array([one.position_rad, one.velocity_rad_s], dtype=np.float64) for one in (last, desired))
    sent = np.empty_like(end)
    drive_kernel.nearest_state(*begin, *end, limit_rows(limits, period_s), period_s, *sent)  # type: ignore[call-arg]
    top = limits.acceleration_rad_s2
    return JointCommand(sent[0], sent[1], np.clip(desired.acceleration_rad_s2, -top, top))


def braked(last: JointCommand, acceleration_rad_s2: Array, step_s: float) -> JointCommand:
    """Return what follows ``last`` after ``step_s`` where every joint slows down with ``acceleration_rad_s2`` (n,)."""
    most = acceleration_rad_s2 * step_s
    slower = np.clip(last.velocity_rad_s, -most, most)
    speed = last.velocity_rad_s - slower
    position = last.position_rad + (last.velocity_rad_s + speed) / 2 * step_s
    return JointCommand(position, speed, -slower / step_s)


def approach(path: tuple[Array, Array], speed_rad_s: float, period_s: float, least_s: float) -> Iterator[JointCommand]:
    """Yield a command for each period of a minimum-jerk motion along ``path``, from start to goal (n,).

    It takes ``least_s`` or longer, at ``speed_rad_s`` at most; the rest at the goal is not among the commands.
    """
    start, goal = path
    span_s = max(minimum_jerk.PEAK_RATE * float(np.abs(goal - start).max()) / speed_rad_s, least_s)
    for t_s in np.arange(period_s, span_s, period_s):
        position = start + float(minimum_jerk.step(t_s / span_s)) * (goal - start)
        speed = float(minimum_jerk.step_rate(t_s / span_s)) / span_s * (goal - start)
        yield JointCommand(position, speed, np.zeros_like(speed))


def check_command(command: JointCommand, limits: JointLimits) -> None:
    """Raise HardwareError for a command that is not finite or absurd: clipped, it would still be a mistake.

    A robot that is given one must also halt.
    """
    check_values("position_rad", command.position_rad, np.full_like(limits.lower_rad, ABSURD_RAD))
    check_values("velocity_rad_s", command.velocity_rad_s, ABSURD_FACTOR * limits.velocity_rad_s)
    check_values("acceleration_rad_s2", command.acceleration_rad_s2, ABSURD_FACTOR * limits.acceleration_rad_s2)
    check_values("effort_nm", command.effort_nm, ABSURD_FACTOR * limits.effort_nm)


def check_values(kind: str, values: Array, most: Array) -> None:
    """Raise HardwareError where one of ``values`` (n,) of a command is not finite, or beyond ``most`` (n,)."""
    given = np.asarray(values)
    if given.shape != most.shape or not (np.abs(given) <= most).all():
        raise HardwareError(
            f"the command's {kind} is {given.tolist()}; allowed: {len(most)} finite numbers of at most "
            f"{most.tolist()}: the robot halts"
        )
