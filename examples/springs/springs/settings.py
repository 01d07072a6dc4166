"""Settings of the controller."""

from dataclasses import dataclass
from typing import Literal

from kendama_cli.extension import setting


@dataclass(frozen=True)
class ControllerSettings:
    kind: Literal["springs"]
    stiffness_n_m: float = setting("Stiffness against displacement [N/m].", above=0)
    stiffness_nm_rad: float = setting("Stiffness against rotation [Nm/rad].", above=0)
    damping_nm_s: float = setting("Damping of every joint [Nm s/rad].", above=0)
