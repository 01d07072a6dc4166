"""Settings of the encoding of demonstrations as a movement primitive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class EncodeSettings:
    """Constants of the primitive (equations.md eq. 3-5), and the fit of its weights."""

    plan: str | None = setting(
        "File of a primitive in JSON or YAML that is used unchanged; null fits one to the demonstrations.", file=True
    )
    functions: int = setting(
        "Number M of Gaussian basis functions per coordinate. More of them follow finer details and more noise.",
        at_least=2,
        at_most=200,
    )
    stiffness: float = setting(
        "Stiffness K of eq. 3, in units of 1 / tau^2; the damping is D = 2 sqrt K.", at_least=1, at_most=1e5
    )
    phase_decay: float = setting(
        "Decay rate alpha of the phase (eq. 4), which falls from 1 to exp(-alpha).", above=0, at_most=20
    )
    width: tuple[float, ...] = setting(
        "Candidates for the width s_j of the Gaussians, as a multiple of the spacing of their centres. The one that "
        "fits all demonstrations best is used.",
        above=0.05,
        at_most=10,
    )
    regression: Literal["lwr", "position"] = setting(
        "Method that fits the weights. 'lwr' is locally weighted regression on the forcing term f, as in the paper; "
        "'position' fits all of them at once to the positions, smoothed by generalised cross-validation."
    )
    passes: int = setting(
        "Number of passes of lwr, each on the residual of the one before; the paper uses 1.", at_least=1
    )
    smoothing_s: float = setting(
        "Window of the local cubics from which lwr takes derivatives and end points [s].", above=0
    )
    trim: Literal["rest", "none"] = setting(
        "Rest before and after the motion: 'rest' cuts it off where the motion shows it, 'none' keeps all rows."
    )
    rest_speed_m_s: float = setting("The hand counts as resting below this speed [m/s].", above=0)
    rest_fraction: float = setting(
        "The hand also counts as resting below this fraction of its peak speed.", at_least=0, below=0.5
    )
    margin_fraction: float = setting(
        "Rest that is kept before and after the motion, as a fraction of its duration, if every demonstration has it.",
        at_least=0,
        at_most=1,
    )
    outliers: Literal["keep", "drop"] = setting(
        "Demonstrations far from the others: 'drop' leaves them out of the average, 'keep' includes them."
    )

    def __post_init__(self) -> None:
        if not self.width:
            raise ConfigError("width", "'width' is an empty list; give at least one candidate, such as [1.0]")
