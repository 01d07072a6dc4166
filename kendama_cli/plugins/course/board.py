"""The board of the course: which learner needs fewest rollouts to a solved swing-up."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.cli import render
from kendama_cli.cli.sweep_view import failure_lines
from kendama_cli.cli.sweep_work import plan_combinations
from kendama_cli.config.site import Site, group_options
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.report.intervals import Between, interquartile_interval, interquartile_mean, mean_interval
from kendama_cli.schema.hints import nearest

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


def show_board(site: Site, learners: Sequence[str], seeds: Sequence[int], task: str, *, as_json: bool) -> int:
    """Run what is not cached, and print the learners in their order; 1 where a run failed."""
    installed = group_options(site, "learn/learner")
    learners = list(dict.fromkeys(learners)) or installed
    for name in learners:
        _check("learner", name, installed)
    _check("task", task, group_options(site, "learn/task"))
    shared = [*OVERRIDES, f"learn/task={task}"]
    learner_of = {(*shared, f"learn/learner={name}", f"seed={seed}"): name for name in learners for seed in seeds}
    pipeline = load_pipeline("swingup", site.pipeline_folders).until("learn")
    records = plan_combinations(site, pipeline, list(learner_of)).run()
    metrics: dict[str, list[dict[str, Any]]] = {}
    for record in records:
        if record.outcome == "done":
            metrics.setdefault(learner_of[tuple(record.overrides)], []).append(record.stages[-1].metrics)
    failures = failure_lines(records)
    for line in failures:
        render.note(line)
    _show(ranked(place_of(name, found) for name, found in metrics.items()), task, as_json=as_json)
    return 1 if failures else 0


def _check(what: str, name: str, allowed: Collection[str]) -> None:
    if name not in allowed:
        raise UsageError(f"there is no {what} '{name}'; allowed: {', '.join(allowed)}{nearest(name, allowed)}")


def _show(places: Sequence[Place], task: str, *, as_json: bool) -> None:
    if as_json:
        render.document({"task": task, "places": [dataclasses.asdict(one) for one in places]})
        return
    rows = [(str(number), *_row(one)) for number, one in enumerate(places, 1)]
    render.table(rows, head=("", "learner", "to solved, IQM [95 %]", "mean [95 %]", "unsolved", "caught: mean / worst"))


def _row(one: Place) -> tuple[str, ...]:
    needed, mean = _with(one.rollouts_to_solved, one.interval), _with(one.mean, one.mean_interval)
    unsolved, caught = f"{one.unsolved} of {one.seeds}", f"{one.caught_rate:.2f} / {one.worst_caught_rate:.2f}"
    return one.learner, needed, mean, unsolved, caught


def _with(value: float, between: Between | None) -> str:
    return f"{value:.0f}" + ("" if between is None else f" [{between[0]:.0f}, {between[1]:.0f}]")
