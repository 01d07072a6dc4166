"""Friction in an arm's joints: its law, and what was learned of it beyond what the controller knows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.schema.arrays import Array, set_arrays

Numbers = TypeVar("Numbers", float, Array)


def dry_friction(coulomb: Numbers, stribeck: Numbers, ratio: Numbers) -> Numbers:
    """Return Fc + Fs exp(-(v / vs)^2), the size of the dry friction at ``ratio`` v / vs: numbers or arrays."""
    fading: Numbers = np.exp(-ratio * ratio)
    return coulomb + stribeck * fading


@dataclass(frozen=True)
class ParametricFriction:
    """Coulomb, Stribeck and viscous friction of n joints, and a constant offset; every array is (n,).

    xi = (Fc + Fs exp(-(v / vs)^2)) sign v + b v + o   (equations.md eq. 2)
    """

    coulomb_nm: Array
    stribeck_nm: Array
    stribeck_rad_s: Array
    viscous_nm_s: Array
    offset_nm: Array

    def __post_init__(self) -> None:
        names = "coulomb_nm", "stribeck_nm", "stribeck_rad_s", "viscous_nm_s", "offset_nm"
        set_arrays(self, **dict.fromkeys(names, (len(self.coulomb_nm),)))
        if not (self.stribeck_rad_s > 0).all():
            raise ValueError(f"stribeck_rad_s must be positive, not {self.stribeck_rad_s.tolist()}")

    def dry_nm(self, velocity_rad_s: Array) -> Array:
        """Return Fc + Fs exp(-(v / vs)^2), the size of the dry friction [Nm], at the velocities (..., n)."""
        ratio = velocity_rad_s * (1.0 / self.stribeck_rad_s)
        return np.asarray(dry_friction(self.coulomb_nm, self.stribeck_nm, ratio))

    def torque_nm(self, velocity_rad_s: Array, direction: Array) -> Array:
        """Return xi (..., n) [Nm]; ``direction`` (..., n) is the sign of v, or a smooth one if readings are noisy."""
        dry = self.dry_nm(velocity_rad_s) * direction
        return np.asarray(dry + self.viscous_nm_s * velocity_rad_s + self.offset_nm)


@dataclass(frozen=True)
class NetworkFriction:
    """One two-layer network with h hidden units for each of n joints (see robot_model.friction)."""

    hidden: Array
    """(n, h, 3): weights of speed and direction, and bias"""
    output: Array
    """(n, h + 1): weights of the hidden units, and bias [Nm]"""

    def __post_init__(self) -> None:
        set_arrays(self, hidden=(None, None, 3))
        n, h, _ = self.hidden.shape
        set_arrays(self, output=(n, h + 1))


@dataclass(frozen=True)
class FrictionModel:
    """The friction torque of n joints over their velocity, beyond what the controller's settings hold, and their servo.

    ``chosen`` is "parametric" or "network": the one with the smaller error on a motion that neither was fitted to,
    whose errors ``parametric_rms_nm`` and ``network_rms_nm`` (n,) are. ``max_speed_rad_s`` (n,) is the highest speed
    seen: beyond it the network is not used. ``servo`` is None where the motion did not show it.
    """

    joint_names: tuple[str, ...]
    chosen: str
    parametric: ParametricFriction
    network: NetworkFriction
    max_speed_rad_s: Array
    parametric_rms_nm: Array
    network_rms_nm: Array
    servo: ServoModel | None = None

    def __post_init__(self) -> None:
        n = len(self.joint_names)
        if self.chosen not in ("parametric", "network"):
            raise ValueError(f"chosen must be 'parametric' or 'network', not {self.chosen!r}")
        set_arrays(self, max_speed_rad_s=(n,), parametric_rms_nm=(n,), network_rms_nm=(n,))
        for name, count in (("parametric", len(self.parametric.coulomb_nm)), ("network", len(self.network.hidden))):
            if count != n:
                raise ValueError(f"{name} is for {count} joints, not {n}")
