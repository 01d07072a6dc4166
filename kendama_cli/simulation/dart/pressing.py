"""How a ball presses on what it touches, by its own momentum."""

from __future__ import annotations

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.world_pair import STEP_S

NOTHING: Array = np.zeros(3)


class PressingForce:
    """``force_n`` (3,) is what a ball has exerted on what it touches: neither rope nor air nor gravity gave it to it.

        force = given + m g - m (v' - v) / T

    Of the last two steps it is the smaller one, so that an impact, which is over, does not count.
    """

    def __init__(self) -> None:
        self.let_go()

    def let_go(self) -> None:
        """Press on nothing, from whatever motion."""
        self.force_n = self._last_n = self._given_n = NOTHING
        self._before_m_s: Array | None = None

    def before(self, velocity_m_s: Array, given_n: Array) -> None:
        """The ball's velocity before a step, and what rope and air give it in that step (3,)."""
        self._before_m_s, self._given_n = velocity_m_s, given_n

    def after(self, velocity_m_s: Array, mass_kg: float, weight_n: Array) -> None:
        """The velocity after that step of a ball of ``mass_kg``, on which gravity acts with ``weight_n`` (3,)."""
        if self._before_m_s is None:
            return
        now_n = self._given_n + weight_n - mass_kg / STEP_S * (velocity_m_s - self._before_m_s)
        last_n, self._last_n = self._last_n, now_n
        self.force_n = now_n if now_n @ now_n < last_n @ last_n else last_n
