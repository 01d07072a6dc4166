"""What a simulated robot's drive follows between two commands."""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.motion.hermite import cubic_between
from kendama_cli.simulation.dart.drive_delay import Reference


def path_between(last: JointCommand, sent: JointCommand, *, steps: int, step_s: float) -> list[Reference]:
    """The reference at the end of every step: the cubic through both commands, the added torque on a line."""
    path = cubic_between(
        (last.position_rad, last.velocity_rad_s), (sent.position_rad, sent.velocity_rad_s), steps=steps, step_s=step_s
    )
    share = np.arange(1, steps + 1)[:, None] / steps
    return list(zip(*path, last.effort_nm + share * (sent.effort_nm - last.effort_nm), strict=True))
