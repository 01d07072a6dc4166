"""What a simulated robot's drive makes of its commands: a path between them, late and lagging."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.schema.arrays import Array

Reference = tuple[Array, Array, Array, Array]
"""Positions, velocities, accelerations and the torque to add (n,), at the end of one step."""


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


class DriveDelay:
    """A pure delay of ``latency_s``, then a lag of first order with the time constant ``lag_s`` (0: none)."""

    def __init__(self, start: Reference, *, latency_s: float, lag_s: float, step_s: float) -> None:
        self._waiting = [start] * round(latency_s / step_s)
        self._share = 1.0 if lag_s <= 0 else 1.0 - math.exp(-step_s / lag_s)
        self._last = start

    def delayed(self, reference: Reference) -> Reference:
        """What the drive follows in the step for which ``reference`` was commanded."""
        self._waiting.append(reference)
        target = self._waiting.pop(0)
        if self._share < 1.0:
            q, v, a, effort = (old + self._share * (new - old) for old, new in zip(self._last, target, strict=True))
            target = (q, v, a, effort)
        self._last = target
        return target
