"""Work of run, plan and config: compose, plan, run, show."""

from __future__ import annotations

import contextlib
import dataclasses
import sys
from collections.abc import Callable
from pathlib import Path

import yaml

from kendama_cli.cli import render
from kendama_cli.cli.config_view import part_with_comments
from kendama_cli.cli.progress import PlainLines, observer
from kendama_cli.cli.repeat import show_end
from kendama_cli.config.compose import Composition, composed, composition
from kendama_cli.config.site import Site
from kendama_cli.errors import MissingPartError
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.command_cache import CommandKey, keep
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner, StagePlan, check_forced, check_ready
from kendama_cli.pipeline.record import RunRecord, begin, version_differences
from kendama_cli.pipeline.runner import Observer, Runner
from kendama_cli.pipeline.watched import configuration_stamps, input_stamps
from kendama_cli.pipeline.where import of_results, open_cluster, open_store, with_executor
from kendama_cli.store.home import home_above

Watcher = Callable[[Observer, RunRecord, Planner], contextlib.AbstractContextManager[Observer]]
"""Returns an observer that reports to the one given and to a page, which is served meanwhile."""


def run_pipeline(
    site: Site,
    pipeline: str,
    until: str | None,
    overrides: list[str],
    force: list[str],
    *,
    on: str | None,
    asked: CommandKey | None,
    began_s: float,
    arm: bool,
    as_json: bool,
    watcher: Watcher | None,
) -> int:
    """Run the pipeline and show its outcome; store it for ``asked``, started at ``began_s``, if nothing is left to
    do.

    The exit code is 1 too where a stage kept what it had and did not come to its end: an arm that stopped, say.
    """
    is_new = not site.home.exists()
    configuration = configuration_stamps(site.considered, pipeline)
    planner, configured = _planned(site, pipeline, until, with_executor(overrides, on))
    forced = check_forced(planner.pipeline, force)
    check_ready(planner, armed=arm)
    record = begin(site.home, pipeline, of_results(overrides))
    record.read = planner.read_lines
    settings = build_settings(configured.config)
    with (
        open_cluster(planner.store, settings, render.note) as cluster,
        PlainLines() if as_json else observer([spec.name for spec in planner.pipeline.stages]) as view,
        contextlib.nullcontext(view) if watcher is None else watcher(view, record, planner) as seen,
    ):
        ask = view.ask if sys.stdin.isatty() else None
        Runner(planner, record, seen, forced=forced, cluster=cluster, ask=ask).run()
    if is_new:
        _tell_new_home(site.home)
    show_end(record, as_json=as_json)
    whole = record.outcome == "done" and all(stage.metrics.get("completed") is not False for stage in record.stages)
    if not forced and whole and asked is not None:
        inputs = input_stamps(planner, settings, site.data_roots)
        plans = planner.plan()
        if inputs is not None and all(plan.result is not None for plan in plans):
            parts = {plan.spec.name: plan.parts for plan in plans}
            if configuration_stamps(site.considered, pipeline) == configuration:
                watched = {**configuration, **inputs, **configured.looked}
                keep(asked, record, parts, watched, read=configured.environment, began_s=began_s)
    return 0 if whole else 1


def _tell_new_home(home: Path) -> None:
    """Tell of a home that this run has made, and of one in a folder above."""
    size = sum(path.stat().st_size for path in home.rglob("*") if path.is_file())
    holds = f"{size / 1e6:.1f} MB of results, logs and cache, which Git ignores"
    render.note(f"made the home {render.short(home)}: {holds}")
    if above := home_above(home):
        render.note(f"each folder has its own; a folder above has one: --home {above}")


def show_plan(
    site: Site, pipeline: str, until: str | None, overrides: list[str], force: list[str], *, as_json: bool
) -> None:
    """Show the stages that would run and why; for the others, versions that differ from those they were computed
    with.
    """
    planner, _ = _planned(site, pipeline, until, overrides)
    plans = planner.plan(check_forced(planner.pipeline, force))
    stages = [_with_doubts(plan, planner.missing[plan.spec.name]) for plan in plans]
    if as_json:
        render.document(render.plan_document(pipeline, overrides, stages))
    else:
        render.plan(stages)


def _with_doubts(stage: StagePlan, lacking: MissingPartError | None) -> StagePlan:
    if stage.result is None:
        return dataclasses.replace(stage, reasons=(*stage.reasons, *([str(lacking)] if lacking else [])))
    differences = version_differences(stage.result.made_with)
    return dataclasses.replace(stage, reasons=(*stage.reasons, *(f"made with {one}" for one in differences)))


def show_configuration(site: Site, overrides: list[str], keys: list[str]) -> None:
    """Show the resolved configuration, checked, as YAML; of ``keys`` alone each value has its meaning as a comment."""
    resolved = composed(site, overrides)
    build_settings(resolved)
    if keys:
        for key in keys:
            render.text(part_with_comments(resolved, key.replace("/", ".")))
        return
    render.text(yaml.safe_dump(resolved, sort_keys=False, allow_unicode=True).rstrip())


def _planned(site: Site, pipeline: str, until: str | None, overrides: list[str]) -> tuple[Planner, Composition]:
    declared = load_pipeline(pipeline, site.pipeline_folders).until(until)
    configured = composition(site, [*declared.overrides, *overrides])
    settings = build_settings(configured.config)
    return Planner(open_store(site.home, settings, render.note), declared, settings, site.data_roots), configured
