"""Play between motor and link."""

from __future__ import annotations

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
        """The links' places, speeds and accelerations (n,) for those of the motors."""
        link = np.clip(self._link, position - self._half_rad, position + self._half_rad)
        pushed = link != self._link
        self._link = link
        self.gap_rad = position - link
        return link, np.where(pushed, velocity, 0.0), np.where(pushed, acceleration, 0.0)
