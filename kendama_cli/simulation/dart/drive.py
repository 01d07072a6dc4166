"""The drive: what a real arm's controller does to a reference before its motors see it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array

Flags = npt.NDArray[np.bool_]
SLACK = 1e-6
"""Relative room for rounding in a reference that is just within its limits."""
LEAST_MARGIN = 0.2
"""Share of the acceleration limit that is left for catching up where the reference itself needs nearly all of it."""


class Drive:
    """Follows a sampled reference of n joints within their limits of position, velocity and acceleration.

    A sample that can be reached from the last one passes unchanged. Otherwise the joint moves with constant
    acceleration for one period, chosen by the discrete time-optimal law (J. Han, IEEE Trans. Ind. Electron. 56(3),
    2009, fhan) on the distance to the reference, then held to the speed limit and to what leaves room to brake:

        v^2 <= 2 A (stop - q)   after every period.

    Arrays are (n,). ``position_rad`` and ``velocity_rad_s`` are where the reference is now, ``mean_rad_s`` is its mean
    speed over the last period; ``limited`` tells whether the last sample was changed.
    """

    def __init__(self, limits: JointLimits, period_s: float) -> None:
        lower_rad, upper_rad = limits.lower_rad, limits.upper_rad
        velocity_rad_s, acceleration_rad_s2 = limits.velocity_rad_s, limits.acceleration_rad_s2
        self._lower, self._upper = lower_rad, upper_rad
        self._fastest, self._top = velocity_rad_s, acceleration_rad_s2
        self._period = period_s
        self._per_period = 1.0 / period_s
        self._change = acceleration_rad_s2 * period_s
        self._most_change = self._change * (1 + SLACK)
        self._most_bend = acceleration_rad_s2 * period_s**2 / 6 * (1 + SLACK) + 1e-12
        brake = velocity_rad_s**2 / (2 * acceleration_rad_s2) + velocity_rad_s * period_s
        self._near_lower, self._near_upper = lower_rad + brake, upper_rad - brake
        self.reset((lower_rad + upper_rad) / 2)

    def reset(self, position_rad: Array) -> None:
        """Rest at ``position_rad``."""
        self.position_rad = np.clip(position_rad, self._lower, self._upper)
        self.velocity_rad_s = self.mean_rad_s = np.zeros_like(self.position_rad)
        self.limited = False

    def follow(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array) -> Array:
        """Move on to the reference for the end of the coming period; returns the change (n,) of ``mean_rad_s`` over it.

        DART moves a joint by its speed at a step's end, so that its speed stands for the middle of the last step.
        """
        last, before = self.velocity_rad_s, self.mean_rad_s
        mean = 0.5 * (last + velocity_rad_s)
        fits = np.abs(velocity_rad_s - last) <= self._most_change
        fits &= np.abs(position_rad - self.position_rad - self._period * mean) <= self._most_bend
        # at top speed there is room to brake anywhere between these
        easy = fits & (np.abs(velocity_rad_s) <= self._fastest)
        easy &= (position_rad >= self._near_lower) & (position_rad <= self._near_upper)
        self.limited = not easy.all() and self._hold_back(position_rad, velocity_rad_s, acceleration_rad_s2, fits)
        if not self.limited:
            self.position_rad, self.velocity_rad_s, self.mean_rad_s = position_rad, velocity_rad_s, mean
        change: Array = (self.mean_rad_s - before) * self._per_period
        return change

    def _hold_back(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array, fits: Flags) -> bool:
        """Move on as far as the limits let every joint; returns False, having done nothing, where they let all pass."""
        last = self.velocity_rad_s
        up, down = self._fastest_up(), self._fastest_down()
        fits = fits & (velocity_rad_s <= up + SLACK) & (velocity_rad_s >= down - SLACK)
        if fits.all():
            return False
        wanted = last + self._period * self._acceleration(position_rad, velocity_rad_s, acceleration_rad_s2)
        # the room to brake is kept exactly from step to step, so this never asks for more than the limit
        velocity = np.clip(np.clip(wanted, last - self._change, last + self._change), down, up)
        position = np.clip(self.position_rad + 0.5 * self._period * (last + velocity), self._lower, self._upper)
        self.position_rad = np.where(fits, position_rad, position)
        self.velocity_rad_s = np.where(fits, velocity_rad_s, velocity)
        self.mean_rad_s = 0.5 * (last + self.velocity_rad_s)
        return True

    def _acceleration(self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array) -> Array:
        """fhan on the error against the reference as it was at the period's start."""
        period = self._period
        before = position_rad - period * velocity_rad_s + 0.5 * period**2 * acceleration_rad_s2
        error = self.position_rad - before
        speed = self.velocity_rad_s - (velocity_rad_s - period * acceleration_rad_s2)
        most = np.maximum(self._top - np.abs(acceleration_rad_s2), LEAST_MARGIN * self._top)
        d = most * period**2
        a0 = period * speed
        y = error + a0
        a2 = a0 + np.sign(y) * (np.sqrt(d * (d + 8 * np.abs(y))) - d) / 2
        a = np.where(np.abs(y) <= d, a0 + y, a2)
        catching_up: Array = -most * np.clip(a / d, -1.0, 1.0)
        return acceleration_rad_s2 + catching_up

    def _fastest_up(self) -> Array:
        half = 0.5 * self._change
        room = half * half - self._change * self.velocity_rad_s + 2 * self._top * (self._upper - self.position_rad)
        fastest: Array = np.minimum(self._fastest, np.sqrt(np.maximum(room, 0.0)) - half)
        return fastest

    def _fastest_down(self) -> Array:
        half = 0.5 * self._change
        room = half * half + self._change * self.velocity_rad_s + 2 * self._top * (self.position_rad - self._lower)
        fastest: Array = -np.minimum(self._fastest, np.sqrt(np.maximum(room, 0.0)) - half)
        return fastest
