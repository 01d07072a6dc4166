"""The drive: what a real arm's controller does to a reference before its motors see it."""

from __future__ import annotations

import numpy as np

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import drive_kernel


class Drive:
    """Drive that follows a reference of n joints within their limits of position, velocity and acceleration.

    A sample passes unchanged where the cubic from the last one to it keeps to all limits and ends with room to brake.
    Otherwise the joint moves with constant acceleration for one period, chosen by the discrete time-optimal law
    (J. Han, IEEE Trans. Ind. Electron. 56(3), 2009, fhan) on the distance to the reference, then held to the speed
    limit and to

        q + w(v) <= stop,   w(v) = v^2 / 2 A + A T^2 / 8   (v T / 2 where v < A T / 2)

    after every period: w is at least the way on which the joint comes to rest in whole periods of constant
    acceleration, so that from such a state the next one can always be reached by braking with A. Where the reference is
    not finite the joint brakes.

    ``state`` and ``limits`` are the arrays on which the compiled law works (drive_kernel.follow).
    """

    def __init__(self, limits: JointLimits, period_s: float) -> None:
        self.limits = limit_rows(limits, period_s)
        self.state: Array = np.zeros((3, len(limits.lower_rad)))
        self._period_s = period_s
        self.reset((limits.lower_rad + limits.upper_rad) / 2)

    def reset(self, position_rad: Array, velocity_rad_s: Array | float = 0.0) -> None:
        """Begin at ``position_rad`` (n,), moving with ``velocity_rad_s``, or as near to that as the limits allow."""
        lower, upper, fastest, top = self.limits[: drive_kernel.TOP + 1]
        place = np.clip(position_rad, lower, upper)
        # w(v) <= v^2 / 2 A + A T^2 / 8, so that there is room for these speeds
        spare = top * self._period_s**2 / 8
        down, up = (np.sqrt(2 * top * np.maximum(room - spare, 0.0)) for room in (place - lower, upper - place))
        self.state[drive_kernel.POSITION] = place
        self.state[drive_kernel.VELOCITY] = np.clip(velocity_rad_s, -np.minimum(down, fastest), np.minimum(up, fastest))
        self.state[drive_kernel.MEAN] = self.state[drive_kernel.VELOCITY]
        self.limited = False
        """Whether the last sample was changed."""

    def follow(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array) -> Array:
        """Move on to the reference for the end of the coming period; returns the change (n,) of its mean speed.

        DART moves a joint by its speed at a step's end, so that its speed stands for the middle of the last step.
        """
        change = np.empty(self.state.shape[1])
        reference = (position_rad, velocity_rad_s, acceleration_rad_s2)
        self.limited = bool(drive_kernel.follow(*reference, self.state, self.limits, self._period_s, change))
        return change

    @property
    def position_rad(self) -> Array:
        """Present position of the reference (n,)."""
        return np.array(self.state[drive_kernel.POSITION])

    @property
    def velocity_rad_s(self) -> Array:
        """Present velocity of the reference (n,)."""
        return np.array(self.state[drive_kernel.VELOCITY])


def limit_rows(limits: JointLimits, period_s: float) -> Array:
    """Return the limits (6, n) for compiled code (drive_kernel.LOWER and so on) for periods of ``period_s``."""
    lower, upper, fastest = limits.lower_rad, limits.upper_rad, limits.velocity_rad_s
    top = limits.acceleration_rad_s2
    brake = fastest**2 / (2 * top) + top * period_s**2 / 8 + fastest * period_s
    return np.stack([lower, upper, fastest, top, lower + brake, upper - brake])
