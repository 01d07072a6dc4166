"""A drive that follows its reference late and lagging."""

from __future__ import annotations

import math

from kendama_cli.schema.arrays import Array

Reference = tuple[Array, Array, Array, Array]
"""Positions, velocities, accelerations and the torque to add (n,), at the end of one step."""


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
