"""What a simulated robot's drive follows between two commands."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.simulation.dart.drive_delay import Reference


def path_between(last: JointCommand, sent: JointCommand, *, steps: int, step_s: float) -> list[Reference]:
    """The reference at the end of every step: the cubic through both commands, the added torque on a line."""
    total = steps * step_s
    q0, v0, q1, v1 = last.position_rad, last.velocity_rad_s, sent.position_rad, sent.velocity_rad_s
    c = (3 * (q1 - q0) / total - 2 * v0 - v1) / total
    d = (v0 + v1 - 2 * (q1 - q0) / total) / total**2
    t = step_s * np.arange(1, steps + 1)[:, None]
    positions = q0 + t * (v0 + t * (c + t * d))
    efforts = last.effort_nm + t / total * (sent.effort_nm - last.effort_nm)
    return list(zip(positions, v0 + t * (2 * c + 3 * t * d), 2 * c + 6 * t * d, efforts, strict=True))
