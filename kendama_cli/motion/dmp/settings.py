"""Settings of the encoding of demonstrations as a movement primitive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class EncodeSettings:
    """The primitive's fixed numbers (equations.md eq. 3-5) and the way its weights are found."""

    plan: str | None = setting("a primitive in JSON or YAML, taken as it is; null: from demonstrations", file=True)
    functions: int = setting("number M of Gaussian basis functions per coordinate", at_least=2, at_most=200)
    stiffness: float = setting("K of eq. 3 in units of 1 / tau^2; D = 2 sqrt K", at_least=1, at_most=1e5)
    phase_decay: float = setting("alpha of eq. 4: the phase falls from 1 to exp(-alpha)", above=0, at_most=20)
    width: tuple[float, ...] = setting(
        "candidates for the width s_j of the Gaussians over the spacing of their centres; the best for all "
        "demonstrations together is taken",
        above=0.05,
        at_most=10,
    )
    regression: Literal["lwr", "ridge", "position"] = setting(
        "lwr: locally weighted regression (the paper's); ridge: all weights at once on f; position: all weights at "
        "once on the positions, which are linear in them, smoothed by generalised cross-validation"
    )
    ridge: float = setting("penalty on the weights of ridge, over the mean feature energy", at_least=0)
    passes: int = setting("times that lwr is repeated on its own residual; 1 is the paper's", at_least=1)
    smoothing_s: float = setting("window of the local cubics that give lwr and ridge derivatives and ends [s]", above=0)
    trim: Literal["rest", "none"] = setting("rest: cut resting heads and tails, found by motion; none: keep all rows")
    rest_speed_m_s: float = setting("below this speed the hand rests [m/s]", above=0)
    rest_fraction: float = setting("the hand also rests below this fraction of its peak speed", at_least=0, below=0.5)
    margin_fraction: float = setting(
        "rest that is kept before and after the motion, as a fraction of it, where every demonstration has some",
        at_least=0,
        at_most=1,
    )
    outliers: Literal["keep", "drop"] = setting("drop: demonstrations far from the others are left out of the average")

    def __post_init__(self) -> None:
        if not self.width:
            raise ConfigError("width", "'width' is an empty list; give at least one candidate, such as [1.0]")
