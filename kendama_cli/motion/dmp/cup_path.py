"""The cup's way for a primitive, before any arm is asked to follow it."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.schema.arrays import Array

SETTLE_SHARE = 0.5
"""After the motion the primitive settles on its goal; this share of its duration is enough to come to rest."""

RESTING_M_S = 1e-6
"""A motion that begins slower than this begins at rest."""

LEAST_LEAD_IN_S = 0.04

AXES = ("x", "y", "z")


class CupPath:
    """A primitive at tau_scale 1 in space: rest, lead-in if it begins moving, the primitive, its settling.

    Places are relative to the swing's start; ``duration_s`` includes all. Raises StageError for a coordinate that is
    not one of space.
    """

    def __init__(self, plan: MotionPlan, lead_in_m_s2: float) -> None:
        self._plan = dataclasses.replace(plan, tau_scale=1.0)
        speed_m_s = float(np.linalg.norm(plan.start_velocity_m_s))
        self.lead_in_s = max(2 * speed_m_s / lead_in_m_s2, LEAST_LEAD_IN_S) if speed_m_s > RESTING_M_S else 0.0
        self.duration_s = self.lead_in_s + plan.duration_s * (1 + SETTLE_SHARE)

    def at(self, t_s: Array) -> Array:
        """Return the positions (n, 3) of the tie point at ``t_s`` (n,) [m]."""
        path = self._in_space(play(self._plan, t_s - self.lead_in_s).position_m)
        early = t_s < self.lead_in_s
        if early.any():
            path[early] = self._lead_in(t_s[early])
        return path

    def _lead_in(self, t_s: Array) -> Array:
        """Return the quintic from rest to the primitive's first position, velocity and acceleration, with a short
        displacement
        back.
        """
        first = play(self._plan, np.array([0.0]))
        total = self.lead_in_s
        place = self._in_space(first.position_m)[0]
        speed = self._in_space(first.velocity_m_s)[0] * total
        change = self._in_space(first.acceleration_m_s2)[0] * total**2
        u = (t_s / total)[:, None]
        way = speed / 2 - change / 12  # with this way the coefficient of u^5 vanishes
        a = 10 * way - 4 * speed + change / 2
        b = -15 * way + 7 * speed - change
        c = 6 * way - 3 * speed + change / 2
        return np.asarray(place - way + u**3 * (a + u * (b + u * c)))

    def _in_space(self, values: Array) -> Array:
        coordinates = self._plan.coordinates
        unknown = [name for name in coordinates if name not in AXES]
        if unknown:
            raise StageError(f"the motion has a coordinate '{unknown[0]}'; allowed: x, y, z")
        space = np.zeros((len(values), 3))
        for column, name in enumerate(coordinates):
            space[:, AXES.index(name)] = values[:, column]
        return space
