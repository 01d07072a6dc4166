"""The joints' friction in DART: damping, and Coulomb and Stribeck friction either as a constraint or as a torque."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kendama_cli.artifacts.friction_model import ParametricFriction
from kendama_cli.schema.arrays import Array


class JointFriction:
    """The friction of n joints of a DART skeleton by the law of ``friction`` (ParametricFriction).

    Viscous friction is DART's damping, which enters its motion implicitly. ``constants`` (5, n) and ``unknown``
    (2,) are the arrays on which the compiled law works (joint_kernel.efforts), which gives the level
    Fc + Fs exp(-(v / vs)^2) of the dry friction: up to it DART's constraint holds a joint (``hold``), or compiled code
    finds the torque (joint_kernel.joint_forces; then ``release``). The offset of ``friction`` is not used: nobody sets
    one.
    """

    def __init__(self, joints: Sequence[Any], friction: ParametricFriction, effort_nm: Array) -> None:
        self._joints = joints
        self._viscous_nm_s = friction.viscous_nm_s
        self.constants = np.stack(
            [
                friction.coulomb_nm,
                friction.stribeck_nm,
                1.0 / friction.stribeck_rad_s,
                friction.viscous_nm_s,
                effort_nm,
            ]
        )
        self.level_nm: Array = np.zeros(len(joints))
        self._held = [-1.0] * len(joints)
        self.set_unknown(0.0, 0.0)

    def set_unknown(self, extra_nm: float, share: float) -> None:
        """Let the joints have ``extra_nm`` of Coulomb friction more, and ``share`` of all that is known on top."""
        factor = 1.0 + share
        self.unknown = np.array([factor, extra_nm])
        for joint, viscous in zip(self._joints, factor * self._viscous_nm_s, strict=True):
            joint.setDampingCoefficient(0, viscous)

    def hold(self) -> None:
        """Let DART's constraint find the dry friction of the coming step, any up to ``level_nm`` (n,)."""
        self._hold(self.level_nm.tolist())

    def release(self) -> None:
        """Let no constraint hold a joint."""
        self._hold([0.0] * len(self._joints))

    def _hold(self, levels: list[float]) -> None:
        if levels != self._held:
            for joint, level, last in zip(self._joints, levels, self._held, strict=True):
                if level != last:
                    joint.setCoulombFriction(0, level)
            self._held = levels
