"""Servo models: how an arm's own position control follows its commands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array, set_arrays


@dataclass(frozen=True)
class ServoModel:
    """Lag, dead time and sag of n joints behind their commands u; every array is (n,).

        u(t) = q(t + d) + T q'(t + d) + s tau(t + d) + c

    with the dead time d, ``dead_time_s``, of all joints, the lags T, ``lag_s``, the compliances s, ``sag_rad_nm``
    [rad/Nm], under the torque tau of the arm's rigid bodies, and the offsets c, ``offset_rad``. ``lag_sigma_s`` is the
    standard deviation of T. A joint that follows well has T = 0. Where a command is held
    for the period that ends at t, d is minus half a period.
    """

    joint_names: tuple[str, ...]
    dead_time_s: float
    lag_s: Array
    lag_sigma_s: Array
    sag_rad_nm: Array
    offset_rad: Array

    def __post_init__(self) -> None:
        shape = (len(self.joint_names),)
        set_arrays(self, lag_s=shape, lag_sigma_s=shape, sag_rad_nm=shape, offset_rad=shape)

    @property
    def delay_s(self) -> float:
        """Dead time and median lag together."""
        return self.dead_time_s + float(np.median(self.lag_s))

    @property
    def follows(self) -> bool:
        """True if the joints follow their commands, so that nothing has to be added to these."""
        terms = (self.lag_s, self.sag_rad_nm, self.offset_rad)
        return self.dead_time_s == 0.0 and not any(term.any() for term in terms)
