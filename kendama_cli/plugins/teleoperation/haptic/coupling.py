"""The virtual coupling between a haptic device and the simulated cup, held passive step by step."""

from __future__ import annotations

import numpy as np

from kendama_cli.plugins.teleoperation.haptic.settings import CouplingSettings
from kendama_cli.schema.arrays import Array

LARGEST_CHANGE_M_S2 = 100.0
"""No hand changes its velocity faster: bounds how far it can move against what is expected."""


class Coupling:
    """Force = K e + B e', e from cup to device; limited, and cut where the coupling would give more than it took.

    The energy that the coupling has taken is known exactly once both ends have moved under the force that was held:

        E_n = E_(n-1) + f_(n-1) . (e_n - e_(n-1))

    (time-domain passivity, Hannaford and Ryu 2002). The cup's next move is known, up to what this force itself adds:
    f T^2 / m. The hand's is known within LARGEST_CHANGE_M_S2 T^2. The force is scaled to the largest share s of it with

        E_n + s a - s^2 |f|^2 T^2 / m >= 0,   a = f . (expected change of e) - |f| LARGEST_CHANGE_M_S2 T^2

    so energy is never given that was not taken, instead of being observed and dissipated afterwards. What was taken
    beyond the spring's own energy is dissipated and forgotten.

    In a stall the hand goes on feeling the force that was last sent, ``felt_n``, while others pulled the cup. What that
    gave the hand cannot be taken back, and a cup without a force would fly off: how long stalls may last is limited
    instead (``period.Lateness``).

    Shapes are (..., 3): many hands at once, in a test.
    """

    def __init__(
        self, settings: CouplingSettings, period_s: float, cup_kg: float, shape: tuple[int, ...] = (3,)
    ) -> None:
        self._settings, self._period_s = settings, period_s
        self._yields_m_n = period_s**2 / cup_kg
        self._reserve_m = LARGEST_CHANGE_M_S2 * period_s**2
        self.energy_j: Array = np.zeros(shape[:-1])
        self.force_n: Array = np.zeros(shape)
        self.felt_n: Array = np.zeros(shape)
        self._apart: Array | None = None
        self._device_m: Array = np.zeros(shape)

    def force(self, device_m: Array, cup_m: Array, free_m: Array, *, held: bool = False) -> Array:
        """Return the force on the cup until the next call [N]; the hand feels the opposite, or ``held`` as before.

        ``free_m`` is how far the cup would move until then without this force.
        """
        apart = device_m - cup_m
        begins = self._apart is None
        moved = apart - (apart if self._apart is None else self._apart)
        hand_m = np.zeros_like(device_m) if begins else device_m - self._device_m
        self._apart, self._device_m = apart, device_m
        own = self._settings
        taken_j = self.energy_j + _dot(self.force_n, moved)
        self.energy_j = np.minimum(taken_j, 0.5 * own.stiffness_n_m * _dot(apart, apart))
        wanted = own.stiffness_n_m * apart + own.damping_n_s_m / self._period_s * moved
        last_n = self.force_n if held else self.felt_n
        force = _limited(last_n + _limited(wanted - last_n, own.max_force_rate_n_s * self._period_s), own.max_force_n)
        length = np.sqrt(_dot(force, force))
        given = self._yields_m_n * length**2
        taken = _dot(force, hand_m - free_m) - length * self._reserve_m
        most = (taken + np.sqrt(taken**2 + 4 * given * np.maximum(self.energy_j, 0.0))) / np.maximum(2 * given, 1e-300)
        share = np.clip(most, 0.0, 1.0)
        self.force_n = force * share[..., None]
        if not held:
            self.felt_n = self.force_n
        return self.force_n


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=-1))


def _limited(vector: Array, most: float) -> Array:
    length = np.sqrt(_dot(vector, vector))[..., None]
    return np.asarray(vector * np.minimum(1.0, most / np.maximum(length, 1e-300)))
