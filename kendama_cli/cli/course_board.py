"""``kendama course board``: every learner on the same seeds, ranked."""

from __future__ import annotations

import dataclasses
import os
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.cli.progress import PlainLines
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.course.board import OVERRIDES, Place, place_of, ranked
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner
from kendama_cli.pipeline.sweep import SweepJob, distinct, run_sweep
from kendama_cli.store.store import Store


def show_board(site: Site, learners: list[str], seeds: Sequence[int], task: str, *, as_json: bool) -> int:
    """Run what is not cached, and print the learners in their order; 1 where a run failed."""
    names = list(dict.fromkeys(learners)) or sorted({path.stem for path in _choices(site)})
    declared = load_pipeline("swingup", site.pipeline_folders).until("learn")
    jobs = []
    for name in names:
        for seed in seeds:
            texts = [*OVERRIDES, f"learn/task={task}", f"learn/learner={name}", f"seed={seed}"]
            settings = build_settings(composed(site, [*declared.overrides, *texts]))
            jobs.append(SweepJob(texts, Planner(Store(site.home), declared, settings, site.data_roots)))
    learner_of = {tuple(job.overrides): job.overrides[2].partition("=")[2] for job in jobs}
    wanted = distinct(jobs)
    records = run_sweep(
        wanted,
        lambda job, record: PlainLines(f"[{job.overrides[2].partition('=')[2]}, {job.overrides[3]}] "),
        at_once=os.cpu_count() or 1,
    )
    metrics, failed = defaultdict(list), 0
    for record in records:
        name = learner_of[tuple(record.overrides)]
        if record.outcome == "done":
            metrics[name].append(record.stages[-1].metrics)
        else:
            failed += 1
            error = record.stages[-1].error if record.stages else record.outcome
            render.note(f"{name}, {record.overrides[3]}: {error}")
    _show(ranked(place_of(name, found) for name, found in metrics.items()), task, as_json=as_json)
    return 1 if failed else 0


def _choices(site: Site) -> list[Path]:
    return [path for folder in site.conf_folders for path in (folder / "learn" / "learner").glob("*.yaml")]


def _show(places: list[Place], task: str, *, as_json: bool) -> None:
    if as_json:
        render.document({"task": task, "places": [dataclasses.asdict(one) for one in places]})
        return
    rows = []
    for number, one in enumerate(places, 1):
        interval = "" if one.interval is None else f" [{one.interval[0]:.0f}, {one.interval[1]:.0f}]"
        caught = f"{one.caught_rate:.2f} / {one.worst_caught_rate:.2f}"
        rows.append(
            (
                str(number),
                one.learner,
                f"{one.rollouts_to_proof:.0f}{interval}",
                f"{one.unproven} of {one.seeds}",
                caught,
            )
        )
    render.table(rows, head=("", "learner", "rollouts to proof [95 %]", "unproven", "caught: mean / worst"))
