"""Settings of the learner; their values stand in conf/learn/learner/mine.yaml."""

from dataclasses import dataclass
from typing import Literal

from kendama_cli.extension import setting


@dataclass(frozen=True)
class Settings:
    kind: Literal["mine"]
    frequency_rad_s: tuple[float, float] = setting("frequencies that are tried at first [rad/s]", above=0)
    remembered: int = setting("how many of the best swings are remembered", at_least=1)
