"""The board: which learner needs fewest rollouts to a solved swing-up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.report.intervals import Between, interquartile_interval, interquartile_mean, mean_interval

OVERRIDES = ("simulation/engine=rail",)
"""Learned and solved on the rail: a rollout there costs a millisecond or two."""


@dataclass(frozen=True)
class Place:
    """Result of a learner over its seeds; unsolved ones count as the cap."""

    learner: str
    seeds: int
    rollouts_to_solved: float
    """Interquartile mean over the seeds."""
    interval: Between | None
    """95 %."""
    mean: float
    """Over the seeds; restricted where some are unsolved, as the cap counts for them."""
    mean_interval: Between | None
    unsolved: int
    caught_rate: float
    """Of the frozen policies, the mean over the seeds."""
    worst_caught_rate: float


def place_of(learner: str, metrics: Sequence[Mapping[str, Any]]) -> Place:
    """Return a learner's place by the metrics of its runs of the stage ``learn``."""
    needed = np.array([float(one["rollouts_to_solved"]) for one in metrics])
    caught = [float(one["frozen_caught_rate"]) for one in metrics]
    return Place(
        learner,
        len(metrics),
        float(interquartile_mean(needed)),
        interquartile_interval(needed),
        float(needed.mean()),
        mean_interval(needed),
        sum(not one["solved"] for one in metrics),
        float(np.mean(caught)),
        min(caught),
    )


def ranked(places: Iterable[Place]) -> list[Place]:
    """Sort, best first: fewer rollouts to solved, then more balls caught by the frozen policies."""
    return sorted(places, key=lambda one: (one.rollouts_to_solved, -one.caught_rate, one.learner))
