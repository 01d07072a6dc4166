"""Predicted position and time of the catch."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.arrays import Array, set_arrays


@dataclass(frozen=True)
class CatchPose:
    """The predicted crossing of the rim plane by the falling ball's centre, and the cup's rotation for it.

    ``position_m`` and ``velocity_m_s`` (3,) are the ball's at ``t_s`` in the world frame; ``covariance_m2`` (3, 3)
    and ``time_sigma_s`` say how well the crossing is known; ``rotation_wxyz`` (4,) rotates the upright cup so that it
    opens against the ball's velocity relative to the cup.
    """

    t_s: float
    position_m: Array
    velocity_m_s: Array
    covariance_m2: Array
    time_sigma_s: float
    rotation_wxyz: Array
    n_observations: int

    def __post_init__(self) -> None:
        set_arrays(self, position_m=(3,), velocity_m_s=(3,), covariance_m2=(3, 3), rotation_wxyz=(4,))
