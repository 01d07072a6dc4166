"""A shift in the horizontal plane that stays within a circle: it brakes in time."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.catch.settings import SteeringSettings

ROUNDING_M = 1e-5
"""The last period of braking is not a whole one: it ends up to b h^2 / 8 farther."""


def shortened(vector: Array, most: float) -> Array:
    """Return ``vector`` at its length, or at ``most``."""
    return np.asarray(vector * min(1.0, most / max(float(np.linalg.norm(vector)), 1e-12)))


def bounded(acceleration_m_s2: Array, shift_m: Array, speed_m_s: Array, h: float, settings: SteeringSettings) -> Array:
    """Return ``acceleration_m_s2`` (2,) for a period of ``h``, or braking where it would lead out of the circle.

    From s (2,) with speed v the cup stops at s + v |v| / (2 b), which braking with b = ``settings.braking_m_s2``
    leaves where it is. That place has to be within ``settings.max_shift_m`` of the plan.
    """
    shift = shift_m + h * (speed_m_s + 0.5 * h * acceleration_m_s2)
    if _stops_inside(shift, speed_m_s + h * acceleration_m_s2, settings):
        return acceleration_m_s2
    inside = _stops_inside(shift_m, speed_m_s, settings)
    return shortened(-speed_m_s / h, settings.braking_m_s2 if inside else settings.acceleration_m_s2)


def brakable(speed_m_s: Array, shift_m: Array, settings: SteeringSettings) -> Array:
    """Return ``speed_m_s`` (2,), or as much of it as can be braked in the circle from ``shift_m`` (2,) on.

    v^2 = 2 b d with d the way along the speed to the circle.
    """
    out_m = float(shift_m @ speed_m_s) / max(float(np.linalg.norm(speed_m_s)), 1e-12)
    left_m = math.sqrt(max(out_m**2 + settings.max_shift_m**2 - float(shift_m @ shift_m), 0.0)) - out_m
    return shortened(speed_m_s, math.sqrt(2 * settings.braking_m_s2 * max(left_m, 0.0)))


def _stops_inside(shift_m: Array, speed_m_s: Array, settings: SteeringSettings) -> bool:
    way_m = speed_m_s * float(np.linalg.norm(speed_m_s)) / (2 * settings.braking_m_s2)
    return float(np.linalg.norm(shift_m + way_m)) <= settings.max_shift_m + ROUNDING_M
