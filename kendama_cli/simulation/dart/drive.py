"""The drive: what a real arm's controller does to a reference before its motors see it."""

from __future__ import annotations

import numpy as np

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import joint_kernel as kernel


class Drive:
    """Follows a sampled reference of n joints within their limits of position, velocity and acceleration.

    A sample that can be reached from the last one passes unchanged. Otherwise the joint moves with constant
    acceleration for one period, chosen by the discrete time-optimal law (J. Han, IEEE Trans. Ind. Electron. 56(3),
    2009, fhan) on the distance to the reference, then held to the speed limit and to what leaves room to brake:

        v^2 <= 2 A (stop - q)   after every period.

    ``state`` and ``limits`` are the arrays on which the compiled law works (joint_kernel.follow).
    """

    def __init__(self, limits: JointLimits, period_s: float) -> None:
        lower, upper, fastest = limits.lower_rad, limits.upper_rad, limits.velocity_rad_s
        top = limits.acceleration_rad_s2
        change = top * period_s
        bend = top * period_s**2 / 6 * (1 + kernel.SLACK) + 1e-12
        brake = fastest**2 / (2 * top) + fastest * period_s
        self.limits = np.stack(
            [lower, upper, fastest, top, change, change * (1 + kernel.SLACK), bend, lower + brake, upper - brake]
        )
        self.state: Array = np.zeros((3, len(lower)))
        self._periods = (period_s, 1.0 / period_s)
        self.reset((lower + upper) / 2)

    def reset(self, position_rad: Array, velocity_rad_s: Array | float = 0.0) -> None:
        """Begin at ``position_rad`` (n,), moving with ``velocity_rad_s``."""
        self.state[:] = velocity_rad_s
        self.state[kernel.POSITION] = np.clip(position_rad, self.limits[kernel.LOWER], self.limits[kernel.UPPER])
        self.limited = False
        """Whether the last sample was changed."""

    def follow(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array) -> Array:
        """Move on to the reference for the end of the coming period; returns the change (n,) of its mean speed.

        DART moves a joint by its speed at a step's end, so that its speed stands for the middle of the last step.
        """
        change = np.empty(self.state.shape[1])
        reference = (position_rad, velocity_rad_s, acceleration_rad_s2)
        self.limited = bool(kernel.follow(*reference, self.state, self.limits, *self._periods, change))
        return change

    @property
    def position_rad(self) -> Array:
        """Where the reference is now (n,)."""
        return np.array(self.state[kernel.POSITION])

    @property
    def velocity_rad_s(self) -> Array:
        """How fast it is now (n,)."""
        return np.array(self.state[kernel.VELOCITY])
