"""Settings of these learners beside those that all learners share (``LearnSettings``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting
from kendama_cli.settings.game import GameSettings


@dataclass(frozen=True)
class DynaSettings:
    """SARSA(lambda) on a table, and a model of its transitions that is learned from beside them."""

    kind: Literal["dyna"]
    planning: int = setting("imagined transitions that are learned from after every real one", at_least=0)
    planning_alpha: float = setting(
        "learning rate of an imagined transition, as a share of that of a real one", above=0, at_most=1
    )
    backup: Literal["q", "sarsa"] = setting(
        "action after an imagined transition: the best one (Dyna-Q), or the one chosen then (Dyna-SARSA)"
    )
    outcomes: int = setting("so many of the last transitions of each pair of state and action are remembered", above=0)


@dataclass(frozen=True)
class TileCodingSettings:
    """SARSA(lambda) on several offset tilings of the state, whose tiles' values add up."""

    kind: Literal["tile_coding"]
    tilings: int = setting("tilings, each offset against the others", above=0)
    position_tiles: int = setting("tiles over the cup's places in the workspace", above=0)
    velocity_tiles: int = setting("tiles over the cup's speeds", above=0)
    angle_tiles: int = setting("tiles over the full circle of the ball's angle", above=0)
    rate_tiles: int = setting("tiles over the ball's angular velocities", above=0)
    max_rate_rad_s: float = setting("angular velocity up to which the tiles reach, on either side [rad/s]", above=0)


@dataclass(frozen=True)
class OpenLoopSettings:
    """A swing of a few parameters in open loop, improved by generations of rollouts."""

    kind: Literal["open_loop"]
    search: Literal["cma", "power", "random"] = setting(
        "CMA-ES, PoWER, or random: their baseline, the best of random swings"
    )
    generation: int = setting("swings tried before the search takes its next step", at_least=4)
    replay_from: float = setting(
        "share of a generation that has to succeed before the search's centre is replayed", above=0, at_most=1
    )
    restart_after: int = setting("generations in a row without a success after which the search begins anew", above=0)
    frequency_rad_s: tuple[float, float] = setting("start of the search: the first frequency, mean -+ deviation")
    chirp_rad_s2: tuple[float, float] = setting("the same of the frequency's change [rad/s^2]")
    amplitude: tuple[float, float] = setting("the same of the amplitude, in half widths of the workspace")

    def __post_init__(self) -> None:
        _check_ranges(self)


@dataclass(frozen=True)
class ModelBasedSettings:
    """A model of the swing, fitted to the rollouts so far, and a search in it for a swing in open loop."""

    kind: Literal["model_based"]
    game: GameSettings
    sampled_rollouts: int = setting("rollouts that play swings drawn from the ranges before the first search", above=0)
    models: int = setting("models, drawn from what the fit leaves open, over which a swing's cost is averaged", above=0)
    candidates: int = setting("swings drawn and tried in the model, from the best of which a search begins", above=0)
    population: int = setting("swings tried in the model before the search takes its next step", at_least=4)
    generations: int = setting("such steps of one search", above=0)
    frequency_rad_s: tuple[float, float] = setting("range of sampled and searched swings: the first frequency")
    chirp_rad_s2: tuple[float, float] = setting("the same of the frequency's change [rad/s^2]")
    amplitude: tuple[float, float] = setting("the same of the amplitude, in half widths of the workspace")

    def __post_init__(self) -> None:
        _check_ranges(self)


def _check_ranges(settings: OpenLoopSettings | ModelBasedSettings) -> None:
    for key in ("frequency_rad_s", "chirp_rad_s2", "amplitude"):
        low, high = getattr(settings, key)
        if not low < high:
            raise ConfigError(key, f"'{key}' is [{low}, {high}]; allowed: [low, high] with low < high")
