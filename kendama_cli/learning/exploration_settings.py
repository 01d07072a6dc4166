"""When a rollout explores, and what it tries then."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class ScheduleSettings:
    """When a rollout explores: until the first success, and from then on by chance after a greedy failure."""

    after_failure: float = setting(
        "probability that the rollout after a greedy failure explores", at_least=0, at_most=1
    )


@dataclass(frozen=True)
class HarmonicExploration:
    """A harmonic A cos(w t + phase) drives the whole rollout, w, A and the phase drawn anew (docs/equations.md)."""

    kind: Literal["harmonic"]
    schedule: ScheduleSettings
    band_rad_s: tuple[float, float] = setting("range of the angular frequency w [rad/s]", above=0)
    amplitude: tuple[float, float] = setting(
        "range of A as a fraction of the largest action, or of the workspace's half width", above=0
    )
    drives: Literal["acceleration", "position", "suited"] = setting(
        "what of the cup is the harmonic; 'suited': the acceleration where a limiter keeps the cup inside, else the "
        "position"
    )
    phase: Literal["quarter", "any"] = setting("'quarter': +-pi/2, it starts from zero; 'any': uniform")
    bang_bang: bool = setting("whether only the sign of the wanted acceleration is kept, at the largest action")

    def __post_init__(self) -> None:
        for key in ("band_rad_s", "amplitude"):
            low, high = getattr(self, key)
            if not 0 < low <= high:
                raise ConfigError(key, f"'{key}' is [{low}, {high}]; allowed: [low, high] with 0 < low <= high")


@dataclass(frozen=True)
class EpsilonGreedyExploration:
    """Each action of an exploring rollout is random with probability epsilon / (1 + k / decay) in rollout k."""

    kind: Literal["epsilon_greedy"]
    schedule: ScheduleSettings
    epsilon: float = setting("probability of a random action in the first rollout", at_least=0, at_most=1)
    decay_rollouts: float = setting("rollouts after which epsilon is halved", above=0)


ExplorationSettings = HarmonicExploration | EpsilonGreedyExploration
