"""Lag of a motion behind its reference: of an arm's joints, or of the cup as it is tracked."""

from __future__ import annotations

import numpy as np

from kendama_cli.schema.arrays import Array

MAX_LAG_S = 0.1
MIN_MOTION = 1e-3
"""Sum of squared speeds from which on something is known [rad^2/s^2 or m^2/s^2]."""


class Lag:
    """Lag as the slope of (desired - read) positions over desired speeds, by least squares over all observations."""

    def __init__(self) -> None:
        self._behind = self._moved = 0.0

    def observe(self, reference: Array | float, speed: Array | float, read: Array | float) -> None:
        """Take the reading ``read`` (n,) of ``reference`` (n,), whose velocity is ``speed`` (n,)."""
        self._behind += float(np.vdot(speed, reference - read))
        self._moved += float(np.vdot(speed, speed))

    @property
    def lag_s(self) -> float:
        """In [0, MAX_LAG_S]; 0 before it has moved [s]."""
        return min(max(self._behind / self._moved, 0.0), MAX_LAG_S) if self._moved > MIN_MOTION else 0.0
