"""The gains of the task-space controllers that come with kendama."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class TaskSpaceGains:
    """Springs and dampers of the tool, and of the posture that it leaves free."""

    stiffness_n_m: tuple[float, float, float] = setting(
        "Stiffness of the tool against displacement along x, y and z of the world [N/m].", above=0
    )
    stiffness_nm_rad: float = setting("Stiffness of the tool against rotation about every axis [Nm/rad].", above=0)
    spin: Literal["held", "free"] = setting(
        "Rotation about the tool's own axis: 'held' by a spring, or 'free', as a round tool allows."
    )
    damping_ratio: float = setting("Damping ratio of every mode of the tool; 1 is critical.", above=0)
    posture_1_s2: float = setting(
        "Stiffness, per inertia, that holds the arm's posture where the tool leaves it free [1/s^2].", at_least=0
    )


@dataclass(frozen=True)
class ImpedanceControl(TaskSpaceGains):
    """The tool behaves as a mass on springs; a desired force is fed forward and adds to the springs' force."""

    kind: Literal["impedance"] = setting("Springs act in every direction.")


@dataclass(frozen=True)
class ForceControl(TaskSpaceGains):
    """Impedance control, but along a desired force no spring acts: the measured force is controlled to it."""

    kind: Literal["force"] = setting("The force is controlled where one is desired; springs act elsewhere.")
    integral_1_s: float = setting("Integral gain on the force error [1/s].", at_least=0)
    reach_m: float = setting(
        "Along a desired force no spring acts until the tool is this far from its reference [m].", above=0
    )
