"""Controllers by impedance: alone, with a wanted force fed forward; or with force control along it.

Force where one is wanted, impedance elsewhere: Raibert and Craig 1981, doi:10.1115/1.3139652.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.plugins.interact.impedance_law import Impedance
from kendama_cli.plugins.interact.interface import JointTorque, TaskReference, TaskState
from kendama_cli.plugins.interact.settings import ForceControl, ImpedanceControl, TaskSpaceGains
from kendama_cli.schema.arrays import Array

FELT_SHARE = 0.1
"""Contact begins where this share of the wanted force is felt: less may be the tool's own inertia."""


def impedance_of(settings: TaskSpaceGains, reach_m: float) -> Impedance:
    """Return the law with the gains of ``settings``."""
    stiffness = np.array([*settings.stiffness_n_m, *[settings.stiffness_nm_rad] * 3])
    return Impedance(stiffness, settings.damping_ratio, settings.posture_1_s2, reach_m, settings.spin == "free")


class ImpedanceController:
    """The force on what is touched is the wanted one plus stiffness times the distance to the reference."""

    def __init__(self, settings: ImpedanceControl) -> None:
        self._impedance = impedance_of(settings, reach_m=0.0)

    def reset(self, posture_rad: Array) -> None:
        """See TaskController."""
        self._posture_rad = posture_rad

    def command(self, state: TaskState, reference: TaskReference, period_s: float) -> JointTorque:
        """See TaskController."""
        stiff = dataclasses.replace(reference, force_share=0.0)
        return self._impedance.command(state, stiff, self._posture_rad, reference.force_n)


class ForceController:
    """Along the force's axis u the push is f_wanted + u integral k (f_wanted - f_measured) u dt.

    The integral waits for contact, and is never more than the wanted force: where nothing is met the tool comes to rest
    no farther from its reference than ``reach_m`` and what that force stretches the springs by.
    """

    def __init__(self, settings: ForceControl) -> None:
        self._impedance = impedance_of(settings, settings.reach_m)
        self._integral_1_s = settings.integral_1_s

    def reset(self, posture_rad: Array) -> None:
        """See TaskController."""
        self._posture_rad = posture_rad
        self._correction_n = 0.0

    def command(self, state: TaskState, reference: TaskReference, period_s: float) -> JointTorque:
        """See TaskController."""
        axis = reference.force_axis
        wanted, measured = float(axis @ reference.force_n), float(axis @ state.contact_n)
        if measured > FELT_SHARE * wanted:
            self._correction_n += self._integral_1_s * (wanted - measured) * period_s
        self._correction_n = float(np.clip(self._correction_n, -wanted, wanted))
        push = reference.force_n + self._correction_n * axis
        return self._impedance.command(state, reference, self._posture_rad, push)
