"""The cup's path for a primitive, the plane in which it swings, and primitives turned about the vertical or scaled."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan, TurnPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.schema.arrays import Array

SETTLE_SHARE = 0.5
"""After the motion the primitive settles on its goal; this fraction of its duration is enough to come to rest."""

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
        position = self._in_space(first.position_m)[0]
        speed = self._in_space(first.velocity_m_s)[0] * total
        change = self._in_space(first.acceleration_m_s2)[0] * total**2
        u = (t_s / total)[:, None]
        path = speed / 2 - change / 12  # with this way the coefficient of u^5 vanishes
        a = 10 * path - 4 * speed + change / 2
        b = -15 * path + 7 * speed - change
        c = 6 * path - 3 * speed + change / 2
        return np.asarray(position - path + u**3 * (a + u * (b + u * c)))

    def _in_space(self, values: Array) -> Array:
        coordinates = self._plan.coordinates
        unknown = [name for name in coordinates if name not in AXES]
        if unknown:
            raise StageError(f"the motion has a coordinate '{unknown[0]}'; allowed: x, y, z")
        space = np.zeros((len(values), 3))
        for column, name in enumerate(coordinates):
            space[:, AXES.index(name)] = values[:, column]
        return space


SAMPLES = 500
LEAST_EXTENT_M = 1e-3
"""A path that goes less far to any side has no plane of its own."""


def heading_turn(heading_rad: float) -> Array:
    """Return the matrix (3, 3) that turns by ``heading_rad`` about the world's z."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def swing_heading_rad(plan: MotionPlan) -> float:
    """Return the angle about z from x to the horizontal direction along which ``plan`` swings.

    That is the first principal axis of its path from above, pointing where the path's third central moment is
    positive, so that the heading of a turned path is turned by as much. It is 0 for a path that goes up and down only,
    or has a coordinate that is not one of space.
    """
    if not set(plan.coordinates) <= set(AXES):
        return 0.0
    path = play(plan, plan.tau_scale * plan.duration_s * np.linspace(0.0, 1.0, SAMPLES)).position_m
    above: Array = np.zeros((SAMPLES, 2))
    for k, name in enumerate(AXES[:2]):
        if name in plan.coordinates:
            above[:, k] = path[:, plan.coordinates.index(name)]
    above -= above.mean(axis=0)
    spread, axes = np.linalg.eigh(above.T @ above / SAMPLES)
    if spread[-1] < LEAST_EXTENT_M**2:
        return 0.0
    along = axes[:, -1] * (1.0 if ((above @ axes[:, -1]) ** 3).sum() >= 0 else -1.0)
    return float(np.arctan2(along[1], along[0]))


def turned_plan(plan: MotionPlan, angle_rad: float) -> MotionPlan:
    """Return ``plan``, of coordinates of space, turned by ``angle_rad`` about z; turned at all it has all of them.

    A primitive is linear in its places, velocities and weights together (equations.md eq. 3), and so is the
    rotation vector of its cup in those of its rotation.
    """
    if angle_rad == 0.0:
        return plan
    rotation = heading_turn(angle_rad)[:, [AXES.index(name) for name in plan.coordinates]]
    c, rows = len(plan.coordinates), len(plan.variation)
    ends = plan.variation[:, 1 : 1 + 3 * c].reshape(rows, 3, c) @ rotation.T
    weights = rotation @ plan.variation[:, 1 + 3 * c :].reshape(rows, c, len(plan.centers))
    cup = plan.turn
    if cup is not None:
        whole = heading_turn(angle_rad)
        cup = TurnPlan(**{field.name: whole @ getattr(cup, field.name) for field in dataclasses.fields(cup)})
    return dataclasses.replace(
        plan,
        coordinates=AXES,
        start_m=rotation @ plan.start_m,
        start_velocity_m_s=rotation @ plan.start_velocity_m_s,
        goal_m=rotation @ plan.goal_m,
        goal_velocity_m_s=rotation @ plan.goal_velocity_m_s,
        weights=rotation @ plan.weights,
        variation=np.hstack(
            (plan.variation[:, :1], ends.reshape(rows, 9), weights.reshape(rows, 3 * len(plan.centers)))
        ),
        turn=cup,
    )


def scaled_plan(plan: MotionPlan, amplitude: float, tau_scale: float) -> MotionPlan:
    """Return the primitive with its motion about the start scaled by ``amplitude``, played at ``tau_scale``.

    The equations are linear in place, goal, weights and end velocities together, so the whole path scales.
    """
    return dataclasses.replace(
        plan,
        tau_scale=tau_scale,
        start_velocity_m_s=plan.start_velocity_m_s * amplitude,
        goal_m=plan.start_m + amplitude * (plan.goal_m - plan.start_m),
        goal_velocity_m_s=plan.goal_velocity_m_s * amplitude,
        weights=plan.weights * amplitude,
        variation=np.hstack((plan.variation[:, :1], plan.variation[:, 1:] * amplitude)),
    )
