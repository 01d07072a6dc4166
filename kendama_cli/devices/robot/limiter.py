"""What a robot's own drive controller does to a command: it never passes the limits."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.robot_model.limits import JointLimits


def limit_command(last: JointCommand, wanted: JointCommand, limits: JointLimits, period_s: float) -> JointCommand:
    """The command nearest to ``wanted`` that can follow ``last`` in one control period within all limits.

    The reference between two commands is the cubic with their positions and velocities; its acceleration is largest
    at the ends,

        a(0) = (6 m - 4 v0 - 2 v1) / T,   a(T) = (4 v1 + 2 v0 - 6 m) / T,   m = (q1 - q0) / T,

    so v1 is clipped first (speed, acceleration, room left to brake before the position limit) and then m.
    """
    q0, v0, top, step = last.position_rad, last.velocity_rad_s, limits.acceleration_rad_s2, period_s
    room_up = np.sqrt(2 * top * np.maximum(limits.upper_rad - q0 - np.maximum(v0, 0.0) * step, 0.0))
    room_down = np.sqrt(2 * top * np.maximum(q0 + np.minimum(v0, 0.0) * step - limits.lower_rad, 0.0))
    fastest = limits.velocity_rad_s
    v1 = np.clip(wanted.velocity_rad_s, -np.minimum(fastest, room_down), np.minimum(fastest, room_up))
    v1 = np.clip(v1, v0 - top * step, v0 + top * step)
    start, end = (4 * v0 + 2 * v1) / 6, (2 * v0 + 4 * v1) / 6
    slack = top * step / 6
    mean = np.clip((wanted.position_rad - q0) / step, np.maximum(start, end) - slack, np.minimum(start, end) + slack)
    mean = np.clip(mean, -fastest, fastest)
    q1 = np.clip(q0 + mean * step, limits.lower_rad, limits.upper_rad)
    return JointCommand(q1, v1, np.clip(wanted.acceleration_rad_s2, -top, top))
