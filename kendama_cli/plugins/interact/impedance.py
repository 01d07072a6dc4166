"""Impedance alone: springs in every direction, a wanted force fed forward."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.plugins.interact.impedance_law import Impedance
from kendama_cli.plugins.interact.interface import JointTorque, TaskReference, TaskState
from kendama_cli.plugins.interact.settings import ImpedanceControl, TaskSpaceGains
from kendama_cli.schema.arrays import Array


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
