"""Result of the stage tempo."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class TempoStudy:
    """Peak speeds (n,) at time scales (n,)."""

    tau_scale: np.ndarray
    peak_speed_m_s: np.ndarray
