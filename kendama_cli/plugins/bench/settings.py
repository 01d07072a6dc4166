"""Settings of learning in an environment of others; the same for every environment."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class BenchSettings:
    """An environment of Gymnasium, and SARSA(lambda) on tiles of its observations."""

    environment: str = setting(
        "Registered name of an environment of Gymnasium, with Box or Discrete observations and actions."
    )
    learner: Literal["sarsa", "q"] = setting("Target of the update, as that of learn.update.")
    exploration: Literal["harmonic", "epsilon_greedy"] = setting(
        "Exploration by a harmonic in each dimension of the action for a whole episode, or by epsilon-greedy actions."
    )
    episodes: int = setting("Number of episodes of learning.", above=0)
    evaluation_episodes: int = setting("The frozen policy and its baselines are evaluated in this many.", above=0)
    max_steps: int = setting("An episode is over after this many actions, where the environment has no limit.", above=0)
    tilings: int = setting("Number of tilings, each offset from the others; 1 gives plain bins.", above=0)
    tiles: int = setting("Number of tiles over the range of each dimension of the observation.", at_least=2)
    ranging_episodes: int = setting(
        "A dimension without bounds has the range that this many exploring episodes show.", above=0
    )
    action_levels: int = setting("Number of levels of each dimension of a continuous action.", at_least=2)
    alpha: float = setting("Learning rate of the first episode, divided among the tilings.", above=0, at_most=1)
    alpha_decay_episodes: float = setting("The learning rate has halved after this many episodes.", above=0)
    gamma: float = setting("Discount factor per action.", at_least=0, at_most=1)
    trace_decay: float = setting("Decay lambda of the eligibility traces.", at_least=0, at_most=1)
    epsilon: float = setting(
        "Probability of a random action with 'epsilon_greedy', in the first episode.", at_least=0, at_most=1
    )
    explore_first: int = setting("The first episodes explore, this many.", at_least=0)
    after_failure: float = setting(
        "Probability of exploring after a greedy episode with a lower return than the elite's median.",
        at_least=0,
        at_most=1,
    )
    elite_size: int = setting("This many harmonics with the highest returns are candidates for mutation.", above=0)
    mutation_fraction: float = setting(
        "Fraction of harmonics that mutate one of the elite; others are sampled anew.", at_least=0, at_most=1
    )

    def __post_init__(self) -> None:
        # Gymnasium imports what stands before a colon, and a value of the configuration imports nothing
        if not re.fullmatch(r"[\w./-]+", self.environment):
            raise ConfigError(
                "environment",
                f"'environment' is {self.environment!r}; allowed: the name of a registered environment, such as "
                "CartPole-v1 (a module before it is not imported)",
            )
