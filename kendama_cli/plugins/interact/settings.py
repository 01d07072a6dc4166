"""The gains of the task-space controllers that come with kendama."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class TaskSpaceGains:
    """Springs and dampers of the tool, and the posture that it leaves free."""

    stiffness_n_m: tuple[float, float, float] = setting("stiffness along the world's x, y, z [N/m]", above=0)
    stiffness_nm_rad: float = setting("stiffness against turning, about every axis [Nm/rad]", above=0)
    spin: Literal["held", "free"] = setting("the turn about the tool's own axis, which a round tool does not need")
    damping_ratio: float = setting("damping of every mode of the tool, 1 being critical", above=0)
    posture_1_s2: float = setting("stiffness of the posture, where the tool leaves it free, over inertia", at_least=0)


@dataclass(frozen=True)
class ImpedanceControl(TaskSpaceGains):
    """The tool is a mass on springs; a wanted force is fed forward and adds to that of the springs."""

    kind: Literal["impedance"] = setting("springs in every direction")


@dataclass(frozen=True)
class ForceControl(TaskSpaceGains):
    """The same, but along a wanted force no spring acts, and the measured force is brought to the wanted one."""

    kind: Literal["force"] = setting("a force where one is wanted, springs elsewhere")
    integral_1_s: float = setting("integral gain of the force's error, over time [1/s]", at_least=0)
    reach_m: float = setting("distance along a desired force at which the tool is free of its reference [m]", above=0)
