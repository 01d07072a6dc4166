"""Settings of these learners beside those that all learners share (``LearnSettings``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting
from kendama_cli.settings.game import GameSettings


@dataclass(frozen=True)
class DynaSettings:
    """SARSA(lambda) on a table that also learns from imagined transitions of a learned model."""

    kind: Literal["dyna"]
    planning: int = setting("Number of imagined transitions that update the table after every real one.", at_least=0)
    planning_alpha: float = setting(
        "Learning rate of an imagined transition, as a fraction of that of a real one.", above=0, at_most=1
    )
    backup: Literal["q", "sarsa"] = setting(
        "Action after an imagined transition: the best one ('q', Dyna-Q), or the one that the policy chooses "
        "('sarsa', Dyna-SARSA)."
    )
    outcomes: int = setting(
        "The model stores this many of the last transitions from each pair of state and action.", above=0
    )


@dataclass(frozen=True)
class TileCodingSettings:
    """SARSA(lambda) on several offset tilings of the state; the values of their tiles are summed."""

    kind: Literal["tile_coding"]
    tilings: int = setting(
        "Number of tilings, each offset from the others. More tilings give a finer resolution.", above=0
    )
    position_tiles: int = setting("Number of tiles over the cup's positions in the workspace.", above=0)
    velocity_tiles: int = setting("Number of tiles over the cup's velocities.", above=0)
    angle_tiles: int = setting("Number of tiles over the full circle of the ball's angle.", above=0)
    rate_tiles: int = setting("Number of tiles over the ball's angular velocities.", above=0)
    max_rate_rad_s: float = setting("The tiles reach up to this angular velocity, in both directions [rad/s].", above=0)


@dataclass(frozen=True)
class OpenLoopSettings:
    """A swing of a few parameters in open loop, improved by generations of rollouts."""

    kind: Literal["open_loop"]
    search: Literal["cma", "power", "random"] = setting(
        "Method of the search: CMA-ES, PoWER, or their baseline 'random', which keeps the best of random swings."
    )
    generation: int = setting("The search updates after this many swings.", at_least=4)
    replay_from: float = setting(
        "If at least this fraction of a generation succeeds, the search's centre is replayed.", above=0, at_most=1
    )
    restart_after: int = setting("The search restarts after this many generations in a row without a success.", above=0)
    frequency_rad_s: tuple[float, float] = setting(
        "Initial range of the swing's first angular frequency: mean -+ one standard deviation [rad/s]."
    )
    chirp_rad_s2: tuple[float, float] = setting(
        "Initial range of the rate at which the frequency changes: mean -+ one standard deviation [rad/s^2]."
    )
    amplitude: tuple[float, float] = setting(
        "Initial range of the amplitude, in half widths of the workspace: mean -+ one standard deviation."
    )

    def __post_init__(self) -> None:
        _check_ranges(self)


@dataclass(frozen=True)
class BayesSettings:
    """A swing of a few parameters in open loop, found by Bayesian optimisation."""

    kind: Literal["bayes"]
    optimism: float = setting(
        "An exploring rollout plays the swing of the highest mean plus this many standard deviations.", at_least=0
    )
    length: float = setting(
        "Length over which the reward changes, in standard deviations of the initial ranges.", above=0
    )
    noise: float = setting("Standard deviation of a rollout's reward, over the reward of the goal.", above=0)
    reach: float = setting(
        "Swings are sought this far from the centre, in standard deviations of the initial ranges.", above=0
    )
    candidates: int = setting("The bound is maximised over twice this many candidates.", above=0)
    frequency_rad_s: tuple[float, float] = setting(
        "Initial range of a swing's first angular frequency: mean -+ one standard deviation [rad/s]."
    )
    chirp_rad_s2: tuple[float, float] = setting(
        "Initial range of the rate at which its frequency changes: mean -+ one standard deviation [rad/s^2]."
    )
    amplitude: tuple[float, float] = setting(
        "Initial range of its amplitude, in half widths of the workspace: mean -+ one standard deviation."
    )

    def __post_init__(self) -> None:
        _check_ranges(self)


@dataclass(frozen=True)
class EliteSettings:
    """Baseline: SARSA's explorer, and the best harmonic so far replayed."""

    kind: Literal["elite"]


@dataclass(frozen=True)
class MonteCarloSettings:
    """Every-visit Monte Carlo control on a table; ``learn.alpha`` and ``learn.gamma`` are its constants."""

    kind: Literal["monte_carlo"]


@dataclass(frozen=True)
class CloneSettings:
    """Counts of the actions of successful rollouts, the most frequent of which is taken."""

    kind: Literal["clone"]


@dataclass(frozen=True)
class ModelBasedSettings:
    """A model of the swing is fitted to the rollouts so far, and searched for a swing in open loop."""

    kind: Literal["model_based"]
    game: GameSettings
    sampled_rollouts: int = setting(
        "This many rollouts play swings sampled from the ranges before the first search.", above=0
    )
    models: int = setting(
        "A swing's cost is the mean over this many models, sampled from the uncertainty of the fit.", above=0
    )
    candidates: int = setting(
        "This many swings are sampled and tried in the model; a search starts from the best of them.", above=0
    )
    population: int = setting("The search in the model updates after this many swings.", at_least=4)
    generations: int = setting("Number of updates of one search.", above=0)
    frequency_rad_s: tuple[float, float] = setting(
        "Range of the first angular frequency of swings that are sampled and searched [rad/s]."
    )
    chirp_rad_s2: tuple[float, float] = setting(
        "Range of the rate at which the frequency of these swings changes [rad/s^2]."
    )
    amplitude: tuple[float, float] = setting("Range of the amplitude of these swings, in half widths of the workspace.")

    def __post_init__(self) -> None:
        _check_ranges(self)


def _check_ranges(settings: OpenLoopSettings | BayesSettings | ModelBasedSettings) -> None:
    for key in ("frequency_rad_s", "chirp_rad_s2", "amplitude"):
        low, high = getattr(settings, key)
        if not low < high:
            raise ConfigError(key, f"'{key}' is [{low}, {high}]; allowed: [low, high] with low < high")
