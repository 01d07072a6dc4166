"""The joints' friction and motors: what of a commanded torque moves the arm."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kendama_cli.artifacts.friction_model import ParametricFriction
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import joint_kernel as kernel

SAFE_STEPS = 4.0
"""A joint's inertia changes with the posture; this is room for it."""


class JointFriction:
    """The motors of n joints of a DART skeleton, and their friction by the law of ``friction`` (ParametricFriction).

    A joint that may stop or turn within the step is held by DART's constraint, which finds the torque, any up to
    Fc + Fs. On one that goes on in its direction the law acts as a torque, which spares the constraint solver most of
    its work: a joint faster than ``slow_rad_s`` (n,) and than what friction could stop in SAFE_STEPS, and one that what
    the motors give leaves enough speed (joint_kernel.efforts); 1 Nm changes a speed by ``change_rad_s`` (n,) in one
    step of ``step_s``. The offset of ``friction`` is not used: nobody sets one.

    ``terms`` and ``constants`` are the arrays on which the compiled law works (joint_kernel.efforts).
    """

    def __init__(
        self,
        joints: Sequence[Any],
        friction: ParametricFriction,
        effort_nm: Array,
        *,
        slow_rad_s: Array,
        change_rad_s: Array,
        step_s: float,
    ) -> None:
        self._joints = joints
        self._known = friction
        self._slow_otherwise = slow_rad_s
        self._change, self._step_s = change_rad_s, step_s
        n = len(joints)
        speeds = 1.0 / friction.stribeck_rad_s
        rows = [
            friction.coulomb_nm,
            friction.stribeck_nm,
            speeds,
            friction.viscous_nm_s,
            np.zeros(n),
            effort_nm,
            change_rad_s,
        ]
        self.constants = np.stack(rows)
        self.terms = np.zeros((3, n))
        self._fades, self._direction = self.terms[: kernel.DIRECTION], self.terms[kernel.DIRECTION]
        self._force_nm, self._held_nm = np.zeros(n), np.zeros(n)
        self.set_unknown(0.0, 0.0)

    def set_unknown(self, extra_nm: float, share: float) -> None:
        """Let the joints have ``extra_nm`` of Coulomb friction more, and ``share`` of all that is known on top."""
        factor, known = 1.0 + share, self._known
        self._unknown = np.array([factor, extra_nm])
        breakaway = factor * known.coulomb_nm + extra_nm + factor * known.stribeck_nm
        self.constants[kernel.SLOW] = self._slow_otherwise + SAFE_STEPS * self._change * breakaway
        self._held = [-1.0] * len(self._joints)
        for joint, viscous in zip(self._joints, factor * known.viscous_nm_s, strict=True):
            joint.setDampingCoefficient(0, viscous)

    def forces(
        self, torque_nm: Array, added_nm: Array, velocity_rad_s: Array, wanted_rad_s2: Array, effort_nm: Array
    ) -> Array | None:
        """The forces (n,) to set for the coming step; the slow joints' constraints get their level.

        The motors give ``torque_nm`` (n,), which without friction would make the accelerations ``wanted_rad_s2`` (n,),
        the compensation of the friction that the controller knows, whose direction
        is that of the speeds in ``terms``, and ``added_nm`` (n,), within their limits; this goes into ``effort_nm``.
        None where it is not finite.
        """
        np.exp(self._fades, out=self._fades)
        np.tanh(self._direction, out=self._direction)
        force, held = self._force_nm, self._held_nm
        if not kernel.efforts(
            torque_nm,
            added_nm,
            velocity_rad_s,
            wanted_rad_s2,
            self._step_s,
            self.constants,
            self.terms,
            self._unknown,
            effort_nm,
            force,
            held,
        ):
            return None
        levels = held.tolist()
        if levels != self._held:
            for joint, level, last in zip(self._joints, levels, self._held, strict=True):
                if level != last:
                    joint.setCoulombFriction(0, level)
            self._held = levels
        return force
