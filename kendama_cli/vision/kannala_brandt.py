"""How far from an image's middle a direction lies: the polynomial of Kannala and Brandt.

J. Kannala, S. S. Brandt, "A generic camera model and calibration method for conventional, wide-angle, and fish-eye
lenses", PAMI 28(8), 2006: a direction at the angle theta off the axis lies at the distance

    g(theta) = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)

from the image's middle, in focal lengths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from kendama_cli.schema.arrays import Array

Angle = TypeVar("Angle", float, Array)
WIDEST_DEG = 89.0
"""There a direction of length 1 along the axis is 57 long."""
LEAST_STEEP = 0.1
"""Of g's slope in the middle: where it is less, the model folds over soon, or has done so."""
NEAR_AXIS = 1e-6
"""An angle [rad] under which limits are taken."""
SMALL_RAD = 1e-3
"""Nearer to the axis a disc is not shifted: the shift is odd in the angle, and nothing is left of it."""
STEPS = 60
"""Of a bracketed Newton's method: by halves alone these reach machine precision."""


@dataclass(frozen=True)
class KannalaBrandt:
    """g, its derivatives and its inverse, up to ``widest_rad``."""

    k1: float
    k2: float
    k3: float
    k4: float

    @cached_property
    def widest_rad(self) -> float:
        """How far off the axis it sees."""
        k = (self.k1, self.k2, self.k3, self.k4)
        rising = [(2 * i + 3) * k[i] for i in (3, 2, 1, 0)]  # of theta^8 .. theta^2 in g'
        squares = np.roots(np.array([*rising, 1.0 - LEAST_STEEP]))
        flat = [math.sqrt(one.real) for one in squares if abs(one.imag) < 1e-12 and one.real > 0]
        return min([math.radians(WIDEST_DEG), *flat])

    @cached_property
    def edge(self) -> float:
        """g at ``widest_rad``."""
        return self.bent(self.widest_rad)[0]

    def bent(self, theta: Angle) -> tuple[Angle, Angle, Angle]:
        """g, its first and its second derivative."""
        q = theta * theta
        value = theta * (1 + q * (self.k1 + q * (self.k2 + q * (self.k3 + q * self.k4))))
        slope = 1 + q * (3 * self.k1 + q * (5 * self.k2 + q * (7 * self.k3 + q * 9 * self.k4)))
        curve = theta * (6 * self.k1 + q * (20 * self.k2 + q * (42 * self.k3 + q * 72 * self.k4)))
        return value, slope, curve

    def off_axis(self, away: Array) -> Array:
        """theta (n,) with g(theta) = ``away`` (n,), which is not beyond the edge."""
        low, high = np.zeros_like(away), np.full_like(away, self.widest_rad)
        theta = np.minimum(away, high)
        for _ in range(STEPS):
            value, slope, _ = self.bent(theta)
            over = value > away
            low, high = np.where(over, low, theta), np.where(over, theta, high)
            step = theta - (value - away) / slope
            after = np.where((step >= low) & (step <= high), step, (low + high) / 2)
            if np.abs(after - theta).max(initial=0.0) < 1e-15:
                break
            theta = after
        return theta

    def off_axis_of(self, away: float) -> float:
        """``off_axis`` of one number, which is not beyond the edge."""
        low, high, theta = 0.0, self.widest_rad, min(away, self.widest_rad)
        for _ in range(STEPS):
            value, slope, _ = self.bent(theta)
            low, high = (low, theta) if value > away else (theta, high)
            after = theta - (value - away) / slope
            after = after if low <= after <= high else (low + high) / 2
            if abs(after - theta) < 1e-15:
                break
            theta = after
        return theta

    def disc(self, theta: Array) -> Array:
        """The mean radius [focal lengths] of the disc of a sphere seen under the half angle 1: g' g / sin(theta)."""
        value, slope, _ = self.bent(theta)
        near = theta <= NEAR_AXIS
        return np.sqrt(slope * np.where(near, 1.0, value / np.where(near, 1.0, np.sin(theta))))

    def disc_shift(self, theta: float) -> float:
        """By how much [focal lengths] the middle of the disc of a cap of the half angle alpha lies farther out than the
        image of its own middle, over alpha^2 / 4:

        g'^2 / g + 3 g'' / 2 - g' / (2 tan(theta)) - g / (2 sin^2(theta))
        """
        value, slope, curve = self.bent(theta)
        flat = slope / (2 * math.tan(theta)) + value / (2 * math.sin(theta) ** 2)
        return slope**2 / value + 1.5 * curve - flat

    def place_slopes(self, points_m: Array) -> Array:
        """d(place in the image) / d(point) (n, 2, 3) [focal lengths] at ``points_m`` (n, 3): g' along theta, g / across
        about the axis."""
        theta, way = angles(points_m)
        across, z = np.hypot(points_m[:, 0], points_m[:, 1]), points_m[:, 2]
        value, slope, _ = self.bent(theta)
        square = across**2 + z**2
        near = across <= NEAR_AXIS * np.abs(z)
        about = np.where(near, 1 / np.where(z == 0, 1.0, z), value / np.where(near, 1.0, across))
        made = np.empty((len(points_m), 2, 3))
        made[:, :, :2] = (slope * z / square - about)[:, None, None] * way[:, :, None] * way[:, None, :]
        made[:, :, :2] += about[:, None, None] * np.eye(2)
        made[:, :, 2] = -(slope * across / square)[:, None] * way
        return made


def angles(points_m: Array) -> tuple[Array, Array]:
    """The angle off the axis (n,) of points (n, 3), and the direction (n, 2) about it, 0 on it."""
    across = np.hypot(points_m[:, 0], points_m[:, 1])
    way = points_m[:, :2] / np.where(across > 0, across, 1.0)[:, None]
    return np.arctan2(across, points_m[:, 2]), way
