"""Ball and rope as identified from a free swing."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array, set_arrays
from kendama_cli.settings.game import GameSettings, MeasuredAir


@dataclass(frozen=True)
class KendamaModel:
    """Length of the rope and drag -(k1 + k2 |v|) v of ball and string, with their standard deviations.

    ``drag_covariance`` (2, 2) is that of k1 and k2, which a swing separates badly: their sum at the swing's speeds is
    known much better than either. ``amplitude_rad`` and ``duration_s`` are the swing's, ``rms_m`` what the fit leaves.
    """

    rope_m: float
    rope_sigma_m: float
    linear_n_s_m: float
    quadratic_n_s2_m2: float
    drag_covariance: Array
    amplitude_rad: float
    duration_s: float
    rms_m: float

    def __post_init__(self) -> None:
        set_arrays(self, drag_covariance=(2, 2))

    def drag_n_s_m(self, speed_m_s: float) -> tuple[float, float]:
        """Return k1 + k2 v, and its standard deviation."""
        by = np.array([1.0, speed_m_s])
        value = self.linear_n_s_m + speed_m_s * self.quadratic_n_s2_m2
        return value, float(np.sqrt(by @ self.drag_covariance @ by))

    def applied(self, game: GameSettings) -> GameSettings:
        """Return ``game`` with the measured rope and air; a coefficient below nothing counts as nothing."""
        rope = dataclasses.replace(game.rope, length_m=self.rope_m)
        air = MeasuredAir("measured", max(self.linear_n_s_m, 0.0), max(self.quadratic_n_s2_m2, 0.0))
        return dataclasses.replace(game, rope=rope, air=air)
