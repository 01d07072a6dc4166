"""Learn in an environment of others: by its name as a stage, or in an environment that is at hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from kendama_cli.api import configuration, run
from kendama_cli.cli import render
from kendama_cli.plugins.bench.artifact import TilePolicy
from kendama_cli.plugins.bench.learner import TabularLearner
from kendama_cli.report.intervals import mean_interval

COLUMNS = ("frozen_return", "replayed_return", "random_return", "gain")


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


def compare(
    environments: Sequence[str],
    learner: str,
    seeds: Sequence[int],
    overrides: Sequence[str],
    *,
    home: Path | None,
    as_json: bool,
) -> None:
    """Learn on every environment with every seed, and print means over the seeds; what is cached is not learned."""
    found = []
    for environment in environments:
        runs = []
        for seed in seeds:
            metrics = learn_on(environment, learner=learner, seed=seed, overrides=overrides, home=home).metrics
            runs.append(metrics)
            render.note(f"{environment} seed {seed}: {render.figures({name: metrics[name] for name in COLUMNS})}")
        found.append(_row(environment, runs))
    if as_json:
        render.document(found)
        return
    head = ("environment", "seeds", *(name.replace("_", " ") for name in COLUMNS))
    render.table(
        [[str(one["environment"]), str(one["seeds"]), *map(_cell, COLUMNS, [one] * 4)] for one in found], head=head
    )


def _row(environment: str, runs: Sequence[Any]) -> dict[str, Any]:
    row: dict[str, Any] = {"environment": environment, "seeds": len(runs)}
    for name in COLUMNS:
        values = np.array([one[name] for one in runs if one[name] is not None], dtype=np.float64)
        row[name] = float(values.mean()) if len(values) else None
        row[f"{name}_interval"] = mean_interval(values) if len(values) > 1 else None
    return row


def _cell(name: str, row: dict[str, Any]) -> str:
    mean, between = row[name], row[f"{name}_interval"]
    if mean is None:
        return ""
    return f"{mean:.4g}" if between is None else f"{mean:.4g} [{between[0]:.4g}, {between[1]:.4g}]"
