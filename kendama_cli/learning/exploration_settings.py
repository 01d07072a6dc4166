"""Settings of exploration: the rollouts that explore, and their actions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class HarmonicSettings:
    """A harmonic A cos(w t + phase) drives the whole rollout, all three drawn at random (equations.md)."""

    band_rad_s: tuple[float, float] = setting("range of the angular frequency w [rad/s]", above=0)
    amplitude: tuple[float, float] = setting(
        "range of A as a fraction of the largest action, or of the workspace's half width", above=0
    )
    drives: Literal["acceleration", "position", "auto"] = setting(
        "quantity of the cup that is harmonic; 'auto': the acceleration if a limiter keeps the cup inside, else the "
        "position"
    )
    phase: Literal["quarter", "any"] = setting("'quarter': +-pi/2, it starts from zero; 'any': uniform")
    bang_bang: bool = setting("use only the sign of the desired acceleration, at the largest action")

    def __post_init__(self) -> None:
        for key in ("band_rad_s", "amplitude"):
            low, high = getattr(self, key)
            if not 0 < low <= high:
                raise ConfigError(key, f"'{key}' is [{low}, {high}]; allowed: [low, high] with 0 < low <= high")


@dataclass(frozen=True)
class ExplorationSettings:
    """Settings of the exploring rollouts of a table: until the first success, and later at random after a failure.

    'harmonic': a harmonic of ``learn.harmonic`` drives the whole rollout, drawn anew, or one of those that ended with
    the largest rewards before, varied a little. 'epsilon_greedy': each action is random with probability
    epsilon / (1 + k / decay) in rollout k.
    """

    kind: Literal["harmonic", "epsilon_greedy"] = setting("actions of an exploring rollout")
    after_failure: float = setting(
        "probability that the rollout after a greedy failure explores", at_least=0, at_most=1
    )
    in_a_row: int = setting("exploring rollouts that follow one another then", above=0)
    mutation_fraction: float = setting(
        "share of the harmonics that vary one of the best before, once there is one", at_least=0, at_most=1
    )
    amplitude_spread: float = setting("standard deviation of the varied amplitude's factor", at_least=0, below=0.5)
    frequency_spread: float = setting("standard deviation of the varied frequency's factor", at_least=0, below=0.5)
    spread_scales: tuple[float, float] = setting(
        "until the first success, range of a factor on both spreads, drawn anew on a logarithmic scale each time",
        above=0,
        at_most=10,
    )
    elite_size: int = setting("so many harmonics, those that ended with the largest rewards, are varied", above=0)
    epsilon: float = setting("probability of a random action in the first rollout", at_least=0, at_most=1)
    decay_rollouts: float = setting("rollouts after which epsilon is halved", above=0)

    def __post_init__(self) -> None:
        low, high = self.spread_scales
        if low > high:
            raise ConfigError("spread_scales", f"'spread_scales' is [{low}, {high}]; allowed: [low, high], low <= high")
