"""Work of sweep: run every combination of overrides, several at a time, and report the outcome of each."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Sequence
from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.cli.sweep_view import SweepView, show_sweep
from kendama_cli.config.site import Site
from kendama_cli.config.sweep import composed_each, expand_sweep
from kendama_cli.pipeline.catalogue import Pipeline, load_pipeline
from kendama_cli.pipeline.nodes import NodeSettings, Remembered, build_settings
from kendama_cli.pipeline.plan import Planner, check_ready
from kendama_cli.pipeline.record import RunRecord
from kendama_cli.pipeline.run_selection import named_sweep
from kendama_cli.pipeline.sweep import SweepJob, distinct, run_sweep
from kendama_cli.pipeline.where import of_results, open_cluster, open_store, with_executor
from kendama_cli.store.store import Store
from kendama_cli.system.processes import cores_shared_by


def sweep_pipeline(
    site: Site,
    pipeline: str,
    until: str | None,
    overrides: list[str],
    *,
    on: str | None,
    jobs: int | None,
    name: str | None,
    report: Path | None,
    as_json: bool,
) -> int:
    """Run every combination, show how each ended, and compare them in one page where ``report`` is given."""
    combinations = expand_sweep(site, with_executor(overrides, on))
    named = named_sweep(site.home, name, overrides, _varying(combinations), time.strftime("%Y-%m-%d", time.gmtime()))
    planned = plan_combinations(site, load_pipeline(pipeline, site.pipeline_folders).until(until), combinations)
    different = distinct(planned.jobs)
    if len(different) < len(planned.jobs):
        render.note(
            f"{len(planned.jobs)} combinations, {len(different)} different: no stage reads what the others change"
        )
    records = dataclasses.replace(planned, jobs=different).run(jobs, named)
    if as_json:
        render.document({"sweep": named, "runs": [record.document() for record in records]})
    else:
        show_sweep(records, named)
    if report is not None:
        from kendama_cli.pipeline.report import write_report  # noqa: PLC0415 - matplotlib and pandas

        render.note(f"report: {write_report([record.document() for record in records], report)}")
    return 0 if all(record.outcome == "done" for record in records) else 1


@dataclasses.dataclass(frozen=True)
class PlannedRuns:
    """Runs of one pipeline, and the settings that say where they work."""

    jobs: list[SweepJob]
    where: NodeSettings
    store: Store

    def run(self, at_once: int | None = None, name: str | None = None) -> list[RunRecord]:
        """Run each while a person watches, ``at_once`` together (None: as many as there are cores); how each ended.

        ``name`` is that of the sweep that they belong to.
        """
        with open_cluster(self.store, self.where, render.note) as cluster, SweepView(self.jobs) as view:
            together = at_once or (os.cpu_count() or 1 if cluster is None else cluster.at_once)
            with cores_shared_by(min(together, len(self.jobs))):
                return run_sweep(self.jobs, view.watch, at_once=together, cluster=cluster, name=name)


def plan_combinations(site: Site, declared: Pipeline, combinations: Sequence[Sequence[str]]) -> PlannedRuns:
    """Return a run for each of ``combinations`` of overrides; raises UsageError if one would move hardware."""
    known = Remembered()
    configs = composed_each(site, [[*declared.overrides, *texts] for texts in combinations])
    settings = [build_settings(config, known) for config in configs]
    store = open_store(site.home, settings[0], render.note)
    planners = (Planner(store, declared, one, site.data_roots, known) for one in settings)
    jobs = [SweepJob(of_results(texts), planner) for texts, planner in zip(combinations, planners, strict=True)]
    for job in jobs:
        check_ready(job.planner, armed=False)
    return PlannedRuns(jobs, settings[0], store)


def _varying(combinations: Sequence[Sequence[str]]) -> list[str]:
    """Return the keys of the overrides in which ``combinations`` differ."""
    values: dict[str, set[str]] = {}
    for text in (one for texts in combinations for one in texts):
        values.setdefault(text.partition("=")[0], set()).add(text)
    return [key for key, found in values.items() if len(found) > 1]
