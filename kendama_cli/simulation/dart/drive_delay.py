"""A drive that follows its reference late, lagging, or with play in its gear."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.schema.arrays import Array


class Backlash:
    """Joints (n,) that follow their motors through a play of ``width_rad`` from end to end.

        link' = clip(link, motor - width / 2, motor + width / 2)

    A link that is not pushed rests. ``gap_rad`` (n,) is how far the motors are ahead of the links.
    """

    def __init__(self, start_rad: Array, width_rad: float) -> None:
        self._half_rad = 0.5 * width_rad
        self._link = np.array(start_rad)
        self.gap_rad: Array = np.zeros_like(self._link)

    def follows(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """Return the links' positions, velocities and accelerations (n,) for those of the motors."""
        link = np.clip(self._link, position - self._half_rad, position + self._half_rad)
        pushed = link != self._link
        self._link = link
        self.gap_rad = position - link
        return link, np.where(pushed, velocity, 0.0), np.where(pushed, acceleration, 0.0)


Reference = tuple[Array, Array, Array, Array]
"""Positions, velocities, accelerations and the torque to add (n,), at the end of one step."""


class DriveDelay:
    """A pure delay of ``latency_s``, then a lag of first order with the time constant ``lag_s`` (0: none)."""

    def __init__(self, start: Reference, *, latency_s: float, lag_s: float, step_s: float) -> None:
        self._waiting = [start] * round(latency_s / step_s)
        self._share = 1.0 if lag_s <= 0 else 1.0 - math.exp(-step_s / lag_s)
        self._last = start

    def delayed(self, reference: Reference) -> Reference:
        """Return the drive's reference in the step for which ``reference`` was commanded."""
        self._waiting.append(reference)
        target = self._waiting.pop(0)
        if self._share < 1.0:
            q, v, a, effort = (old + self._share * (new - old) for old, new in zip(self._last, target, strict=True))
            target = (q, v, a, effort)
        self._last = target
        return target
