"""The joints' friction: what the simulated joints have, and what the controller knows of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kendama_cli.artifacts.friction_model import ParametricFriction
from kendama_cli.schema.arrays import Array

REVERSAL_RAD_S = 0.02
"""The controller's compensation turns its sign over about this speed."""
SAFE_STEPS = 4.0
"""A joint's inertia changes with the posture; this is room for it."""


class JointFriction:
    """The friction of n joints of a DART skeleton, by the law of ``friction`` (see ParametricFriction).

    A slow joint may stop or turn within the step: there DART's constraint finds the torque, any up to Fc + Fs, that
    holds it. On a faster one the law acts as a torque, which spares the constraint solver most of its work. Slow is
    what other torques could stop, ``slow_rad_s`` (n,), and beyond that what friction itself could in SAFE_STEPS, where
    1 Nm changes the speed by ``change_rad_s`` (n,) in one. The offset of ``friction`` is not used: nobody sets one.
    """

    def __init__(
        self, joints: Sequence[Any], friction: ParametricFriction, *, slow_rad_s: Array, change_rad_s: Array
    ) -> None:
        self._joints = joints
        self._known = friction
        self._slow_otherwise = slow_rad_s
        self._change = change_rad_s
        self._fades = bool(friction.stribeck_nm.any())
        self._any = bool(friction.coulomb_nm.any() or self._fades or friction.viscous_nm_s.any())
        self.set_unknown(0.0, 0.0)

    def set_unknown(self, extra_nm: float, share: float) -> None:
        """Let the joints have ``extra_nm`` of Coulomb friction more, and ``share`` of all that is known on top."""
        self._factor = 1.0 + share
        self._extra_nm = extra_nm
        self._slow = self._slow_below()
        self._held = [-1.0] * len(self._joints)
        for joint, viscous in zip(self._joints, self._factor * self._known.viscous_nm_s, strict=True):
            joint.setDampingCoefficient(0, viscous)

    def torque(self, velocity_rad_s: Array) -> Array:
        """The friction (n,) that acts as a torque in the coming step; the other joints get their constraint's level."""
        level = self._factor * self._dry_nm(velocity_rad_s) + self._extra_nm
        fast = np.abs(velocity_rad_s) > self._slow
        held = np.where(fast, 0.0, level).tolist()
        if held != self._held:
            for joint, value, last in zip(self._joints, held, self._held, strict=True):
                if value != last:
                    joint.setCoulombFriction(0, value)
        self._held = held
        torque: Array = -np.copysign(level, velocity_rad_s) * fast
        return torque

    def compensation(self, wanted_rad_s: Array, velocity_rad_s: Array) -> Array | float:
        """The torque (n,) that a controller adds for the friction it knows, its direction that of ``wanted_rad_s``."""
        if not self._any:
            return 0.0
        dry = self._dry_nm(wanted_rad_s) * np.tanh(wanted_rad_s * (1.0 / REVERSAL_RAD_S))
        torque: Array = dry + self._known.viscous_nm_s * velocity_rad_s
        return torque

    def _dry_nm(self, velocity_rad_s: Array) -> Array:
        return self._known.dry_nm(velocity_rad_s) if self._fades else self._known.coulomb_nm

    def _slow_below(self) -> Array:
        breakaway = self._factor * (self._known.coulomb_nm + self._known.stribeck_nm) + self._extra_nm
        slow: Array = self._slow_otherwise + SAFE_STEPS * self._change * breakaway
        return slow
