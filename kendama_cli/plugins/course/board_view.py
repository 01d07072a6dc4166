"""``kendama course board``: every learner on the same seeds, ranked."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from typing import Any

from kendama_cli.cli import render
from kendama_cli.cli.sweep_view import failure_lines
from kendama_cli.cli.sweep_work import plan_combinations
from kendama_cli.config.site import Site, group_options
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.plugins.course.board import OVERRIDES, Place, place_of, ranked
from kendama_cli.report.intervals import Between
from kendama_cli.schema.hints import nearest


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
