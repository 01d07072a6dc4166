"""Free flight of a ball under gravity and air drag."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.physics.free_fall import drag_over_speed
from kendama_cli.schema.arrays import Array, set_arrays

STEP_S = 0.05
"""Longest step of the integration: over 0.6 s of flight it is then within 1e-7 m."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = (1.0 + NODES) / 2.0, WEIGHTS / 2.0
"""Gauss and Legendre's, of the interval from 0 to 1."""
STILL_M_S = 1e-9


class Transition(NamedTuple):
    """Derivatives of position and velocity after a time by the first velocity: (3, 3) each."""

    position_s: Array
    velocity: Array


@dataclass(frozen=True)
class FreeFlight:
    """Motion z'' = g - (k1 + k2 |z'|) z' of a ball on a slack rope (equations.md eq. 1), both k over its mass.

    Without k2 it is linear in the first position and velocity: with a(s) = (1 - exp(-k1 s)) / k1 and b(s) =
    (s - a(s)) / k1 the position after s seconds is z0 + a(s) z0' + b(s) g and the velocity z0' exp(-k1 s) + a(s) g.
    With it, the motion is integrated by Runge and Kutta's method of the fourth order.
    """

    gravity_m_s2: Array
    """(3,)"""
    drag_per_s: float
    drag_per_m: float = 0.0

    def __post_init__(self) -> None:
        set_arrays(self, gravity_m_s2=(3,))
        for name in ("drag_per_s", "drag_per_m"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must not be negative, it is {getattr(self, name)!r}")

    def velocity_gain_s(self, s: ArrayLike) -> Array:
        """a(s) [s] of the linear part, shape of ``s``."""
        s = np.asarray(s, dtype=np.float64)
        k = self.drag_per_s
        return -np.expm1(-k * s) / k if k > 0 else s.copy()

    def gravity_gain_s2(self, s: ArrayLike) -> Array:
        """b(s) [s^2] of the linear part, shape of ``s``; by its series where (s - a) / k1 would cancel."""
        s = np.asarray(s, dtype=np.float64)
        x = self.drag_per_s * s
        series = s * s * (0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x / 720))))
        if self.drag_per_s == 0:
            return np.asarray(series)
        return np.where(np.abs(x) < 0.02, series, (s - self.velocity_gain_s(s)) / self.drag_per_s)

    def position_m(self, start_m: Array, velocity_m_s: Array, s: ArrayLike) -> Array:
        """Position (..., 3) after ``s`` (...) seconds from ``start_m`` (3,) with ``velocity_m_s`` (3,)."""
        return self.moved(start_m, velocity_m_s, s)[0]

    def moved(self, start_m: Array, velocity_m_s: Array, s: ArrayLike) -> tuple[Array, Array]:
        """Position and velocity (..., 3) after ``s`` (...) seconds, which may be negative."""
        if self.drag_per_m > 0:
            times = np.asarray(s, dtype=np.float64)
            flown = [self._flown(start_m, velocity_m_s, float(t)) for t in times.ravel()]
            both = np.array(flown).reshape(*times.shape, 2, 3)
            return both[..., 0, :], both[..., 1, :]
        s = np.asarray(s, dtype=np.float64)[..., None]
        a, b = self.velocity_gain_s(s), self.gravity_gain_s2(s)
        velocity = (1.0 - self.drag_per_s * a) * velocity_m_s + a * self.gravity_m_s2
        return np.asarray(start_m + a * velocity_m_s + b * self.gravity_m_s2), np.asarray(velocity)

    def transition(self, velocity_m_s: Array, s: float) -> Transition:
        """Return the derivatives of position and velocity after ``s`` seconds by the first velocity (3,).

        With k2, to its first order: dv(s)/dv0 = 1 - int S dt with S = (k1 + k2 |v|) 1 + k2 v v^T / |v|.
        """
        if self.drag_per_m == 0:
            a = float(self.velocity_gain_s(s))
            return Transition(a * np.eye(3), (1.0 - self.drag_per_s * a) * np.eye(3))
        speeds = velocity_m_s + (s * NODES)[:, None] * self.gravity_m_s2
        size = np.sqrt((speeds * speeds).sum(axis=1)) + STILL_M_S
        drag, along = drag_over_speed(self.drag_per_s, self.drag_per_m, size), self.drag_per_m / size

        def integrated(weights: Array) -> Array:
            return np.asarray(float(weights @ drag) * np.eye(3) + (speeds.T * (weights * along)) @ speeds)

        return Transition(
            s * np.eye(3) - s * s * integrated(WEIGHTS * (1.0 - NODES)),
            np.eye(3) - s * integrated(WEIGHTS),
        )

    def descent_s(self, start_m: Array, velocity_m_s: Array, height_m: float) -> float | None:
        """Return the time at which the ball falls through ``height_m``: the later root of z(s); None if never.

        Newton's method from the root without drag; the root may be negative, when the ball is already below.
        """
        g = -float(self.gravity_m_s2[2])
        start, rise = float(start_m[2]), float(velocity_m_s[2])
        if g <= 0:
            return None
        discriminant = rise**2 + 2 * g * (start - height_m)
        if discriminant <= 0:
            return None
        s = (rise + math.sqrt(discriminant)) / g
        for _ in range(20 if self.drag_per_s > 0 or self.drag_per_m > 0 else 0):
            position, speed = self.moved(start_m, velocity_m_s, s)
            rate = float(speed[2])
            if rate >= 0:  # with drag the apex stays below the plane
                return None
            step = (float(position[2]) - height_m) / rate
            s -= step
            if abs(step) < 1e-12:
                break
        return s

    def _flown(self, start_m: Array, velocity_m_s: Array, s: float) -> tuple[Array, Array]:
        """Position and velocity (3,) after ``s`` seconds; in plain numbers, which is faster for one time."""
        k1, k2 = self.drag_per_s, self.drag_per_m
        gx, gy, gz = self.gravity_m_s2.tolist()
        vx, vy, vz = (float(value) for value in velocity_m_s)
        x, y, z = (float(value) for value in start_m)

        def slope(ux: float, uy: float, uz: float) -> tuple[float, float, float]:
            drag = drag_over_speed(k1, k2, math.sqrt(ux * ux + uy * uy + uz * uz))
            return gx - drag * ux, gy - drag * uy, gz - drag * uz

        steps = max(1, math.ceil(abs(s) / STEP_S))
        h = s / steps
        for _ in range(steps):
            ax, ay, az = slope(vx, vy, vz)
            bx, by, bz = slope(vx + 0.5 * h * ax, vy + 0.5 * h * ay, vz + 0.5 * h * az)
            cx, cy, cz = slope(vx + 0.5 * h * bx, vy + 0.5 * h * by, vz + 0.5 * h * bz)
            dx, dy, dz = slope(vx + h * cx, vy + h * cy, vz + h * cz)
            x += h * (vx + h * (ax + bx + cx) / 6)
            y += h * (vy + h * (ay + by + cy) / 6)
            z += h * (vz + h * (az + bz + cz) / 6)
            vx += h * (ax + 2 * bx + 2 * cx + dx) / 6
            vy += h * (ay + 2 * by + 2 * cy + dy) / 6
            vz += h * (az + 2 * bz + 2 * cz + dz) / 6
        return np.array([x, y, z]), np.array([vx, vy, vz])


def tilted_gravity(magnitude_m_s2: float, tilt_rad: ArrayLike) -> Array:
    """Return the gravity vector (3,) of a frame whose vertical tilts by ``tilt_rad`` (2,) towards +x and +y."""
    x, y = np.tan(np.asarray(tilt_rad, dtype=np.float64))
    return np.asarray(magnitude_m_s2 / math.sqrt(x * x + y * y + 1) * np.array([x, y, -1.0]))
