"""What sweep does: every combination of overrides, several at a time, and how each ended."""

from __future__ import annotations

import os
from pathlib import Path

from kendama_cli.cli import render
from kendama_cli.cli.sweep_view import SweepView, show_sweep
from kendama_cli.config.site import Site
from kendama_cli.config.sweep import composed_each, expand_sweep
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner, check_armed
from kendama_cli.pipeline.remembered import Remembered
from kendama_cli.pipeline.sweep import SweepJob, distinct, run_sweep
from kendama_cli.pipeline.where import of_results, open_cluster, open_store, with_executor
from kendama_cli.system.processes import cores_shared_by


def sweep_pipeline(
    site: Site,
    pipeline: str,
    until: str | None,
    overrides: list[str],
    *,
    on: str | None,
    jobs: int | None,
    report: Path | None,
    as_json: bool,
) -> int:
    """Run every combination, show how each ended, and compare them in one page where ``report`` is given."""
    combinations = expand_sweep(site, with_executor(overrides, on))
    declared = load_pipeline(pipeline, site.pipeline_folders).until(until)
    configs = composed_each(site, [[*declared.overrides, *texts] for texts in combinations])
    known = Remembered()
    settings = [build_settings(config, known) for config in configs]
    where = settings[0]
    store = open_store(site.home, where, render.note)
    planners = (Planner(store, declared, one, site.data_roots, known) for one in settings)
    wanted = distinct(
        [SweepJob(of_results(texts), planner) for texts, planner in zip(combinations, planners, strict=True)]
    )
    for job in wanted:
        check_armed(job.planner, armed=False)
    with open_cluster(store, where, render.note) as cluster, SweepView(wanted) as view:
        at_once = jobs or (os.cpu_count() or 1 if cluster is None else cluster.at_once)
        with cores_shared_by(min(at_once, len(wanted))):
            records = run_sweep(wanted, view.watch, at_once=at_once, cluster=cluster)
    if as_json:
        render.document({"runs": [record.document() for record in records]})
    else:
        show_sweep(records)
    if report is not None:
        from kendama_cli.pipeline.report import write_report  # noqa: PLC0415 - matplotlib and pandas

        render.note(f"report: {write_report([record.document() for record in records], report)}")
    return 0 if all(record.outcome == "done" for record in records) else 1
