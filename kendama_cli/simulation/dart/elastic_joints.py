"""Elastic joints: links that swing about their motors, on which the encoders are."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm

from kendama_cli.schema.arrays import Array


class ElasticJoints:
    """Deflections d = q_link - q_motor of n joints, each a damped spring that its motor's acceleration excites.

        d'' + 2 zeta w d' + w^2 d = -q_motor'',   w = 2 pi ``resonance_hz``, zeta = ``damping``

    All joints have one frequency, that of the whole arm's first mode. A step of ``step_s`` is exact for an acceleration
    that is constant in it. Weight and rope, which deflect them too, are left out.
    """

    def __init__(self, joints: int, resonance_hz: float, damping: float, step_s: float) -> None:
        w = 2 * math.pi * resonance_hz
        self._spring = np.array([w * w, 2 * damping * w])
        system = np.zeros((3, 3))  # d, d' and the constant acceleration
        system[0, 1], system[1, :2], system[1, 2] = 1.0, -self._spring, -1.0
        self._step = expm(step_s * system)[:2]
        self._state = np.zeros((3, joints))

    @property
    def deflection_rad(self) -> Array:
        """The deflections (n,) now."""
        return np.asarray(self._state[0])

    def swung(self, acceleration_rad_s2: Array) -> tuple[Array, Array, Array]:
        """Return the deflections (n,) now, their velocities and accelerations, and step on.

        The motors accelerate by ``acceleration_rad_s2`` (n,) in the coming step.
        """
        position, velocity, self._state[2] = self._state[0], self._state[1], acceleration_rad_s2
        change = -self._spring @ self._state[:2] - acceleration_rad_s2
        stepped = self._step @ self._state
        swung = position.copy(), velocity.copy(), change
        self._state[:2] = stepped
        return swung
