"""Free flight of a ball under gravity and linear air drag, exact and linear in the initial state."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.schema.arrays import Array, array


@dataclass(frozen=True)
class FreeFlight:
    """The motion z'' = g - k z' of PAPER.md eq. 1 with a slack rope, k = Ka / m.

    With a(s) = (1 - exp(-k s)) / k and b(s) = (s - a(s)) / k the position after s seconds is
    z(s) = z0 + a(s) z0' + b(s) g, and the velocity z0' exp(-k s) + a(s) g: linear in (z0, z0'), drag included.
    """

    gravity_m_s2: Array
    """(3,)"""
    drag_per_s: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "gravity_m_s2", array("gravity_m_s2", self.gravity_m_s2, (3,)))
        if self.drag_per_s < 0:
            raise ValueError(f"drag_per_s must not be negative, it is {self.drag_per_s!r}")

    def gains(self, s: float) -> tuple[float, float]:
        """a(s) [s] and b(s) [s^2] of one moment, without the cost of arrays."""
        k = self.drag_per_s
        if k == 0:
            return s, s * s / 2
        x, a = k * s, -math.expm1(-k * s) / k
        return a, s * s * (0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x / 720)))) if abs(x) < 0.02 else (s - a) / k

    def velocity_gain_s(self, s: ArrayLike) -> Array:
        """a(s) [s], shape of ``s``."""
        s = np.asarray(s, dtype=np.float64)
        k = self.drag_per_s
        return -np.expm1(-k * s) / k if k > 0 else s.copy()

    def gravity_gain_s2(self, s: ArrayLike) -> Array:
        """b(s) [s^2], shape of ``s``; by its series where (s - a) / k would cancel."""
        s = np.asarray(s, dtype=np.float64)
        x = self.drag_per_s * s
        series = s * s * (0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x / 720))))
        if self.drag_per_s == 0:
            return np.asarray(series)
        return np.where(np.abs(x) < 0.02, series, (s - self.velocity_gain_s(s)) / self.drag_per_s)

    def position_m(self, start_m: Array, velocity_m_s: Array, s: ArrayLike) -> Array:
        """Position (..., 3) after ``s`` (...) seconds from ``start_m`` (3,) with ``velocity_m_s`` (3,)."""
        a, b = self.velocity_gain_s(s)[..., None], self.gravity_gain_s2(s)[..., None]
        return np.asarray(start_m + a * velocity_m_s + b * self.gravity_m_s2)

    def velocity_m_s(self, velocity_m_s: Array, s: ArrayLike) -> Array:
        """Velocity (..., 3) after ``s`` (...) seconds from ``velocity_m_s`` (3,)."""
        decay = np.exp(-self.drag_per_s * np.asarray(s, dtype=np.float64))[..., None]
        return np.asarray(decay * velocity_m_s + self.velocity_gain_s(s)[..., None] * self.gravity_m_s2)

    def descent_s(self, start_m: Array, velocity_m_s: Array, height_m: float) -> float | None:
        """When the ball falls through ``height_m``: the later root of z(s), counted from the start; None if never.

        Newton's method from the root without drag; the root may be negative, when the ball is already below.
        """
        g, k = -float(self.gravity_m_s2[2]), self.drag_per_s
        start, rise = float(start_m[2]), float(velocity_m_s[2])
        if g <= 0:
            return None
        discriminant = rise**2 + 2 * g * (start - height_m)
        if discriminant <= 0:
            return None
        s = (rise + math.sqrt(discriminant)) / g
        for _ in range(20 if k > 0 else 0):
            a, b = self.gains(s)
            rate = math.exp(-k * s) * rise - a * g
            if rate >= 0:  # with drag the apex stays below the plane
                return None
            step = (start + a * rise - b * g - height_m) / rate
            s -= step
            if abs(step) < 1e-13:
                break
        return s


def tilted_gravity(magnitude_m_s2: float, tilt_rad: ArrayLike) -> Array:
    """The gravity vector (3,) of a frame whose vertical is tilted: ``tilt_rad`` (2,) is how far towards +x and +y."""
    x, y = np.tan(np.asarray(tilt_rad, dtype=np.float64))
    return np.asarray(magnitude_m_s2 / math.sqrt(x * x + y * y + 1) * np.array([x, y, -1.0]))
