"""Learn in an environment of others: by its name as a stage, or in an environment that is at hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from kendama_cli.api import configuration, run
from kendama_cli.plugins.bench.artifact import TilePolicy
from kendama_cli.plugins.bench.learner import TabularLearner


@dataclass(frozen=True)
class Learned:
    """A frozen policy, and the metrics of the stage ``bench``."""

    policy: TilePolicy
    metrics: Mapping[str, Any]


def learn_on(
    environment: str | gymnasium.Env[Any, Any],
    *,
    learner: str = "sarsa",
    seed: int = 0,
    overrides: Sequence[str] = (),
    home: Path | str | None = None,
) -> Learned:
    """Learn on tiles in ``environment``.

    Parameters
    ----------
    environment : str or gymnasium.Env
        A registered name, learned in as by ``kendama run -p bench`` and cached; or an environment, which is not.
    learner : str
        ``sarsa`` or ``q``.
    seed : int
        Of all random numbers.
    overrides : sequence of str
        ``bench.KEY=VALUE``, as on the command line.
    home : path, optional
        The store; by default ``KENDAMA_HOME`` or ``.kendama``.

    Returns
    -------
    Learned

    Raises
    ------
    ConfigError
        If a value does not fit, or the spaces are not Box or Discrete.
    StageError
        If the environment cannot be made, or gives what is no finite number.
    """
    chosen = [f"bench.learner={learner}", *overrides]
    if isinstance(environment, str):
        made = run("bench", [f"bench.environment={environment}", f"seed={seed}", *chosen], home=home)
        return Learned(made.artifact("bench"), made.metrics("bench"))
    own = configuration(chosen)["bench"]
    at_work = TabularLearner(environment, own, np.random.default_rng(seed))
    for _ in range(own.episodes):
        at_work.episode()
    metrics = at_work.evaluated(own.evaluation_episodes)
    return Learned(at_work.policy(), metrics)
