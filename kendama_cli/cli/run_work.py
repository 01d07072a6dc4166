"""What run, plan and config do: compose, plan, run, show."""

from __future__ import annotations

from typing import Any

import yaml

from kendama_cli.cli import render
from kendama_cli.cli.progress import PlainLines, observer
from kendama_cli.cli.repeat import next_step
from kendama_cli.config.compose import composed, depends_on_surroundings
from kendama_cli.config.site import Site
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner, check_armed, check_forced
from kendama_cli.pipeline.record import begin
from kendama_cli.pipeline.runner import Runner
from kendama_cli.pipeline.unchanged import Question, keep
from kendama_cli.pipeline.watched import configuration_stamps, input_stamps
from kendama_cli.store.store import Store


def run_pipeline(
    site: Site,
    pipeline: str,
    until: str | None,
    overrides: list[str],
    force: list[str],
    *,
    asked: Question | None,
    began_s: float,
    arm: bool,
    as_json: bool,
) -> int:
    """Run, show how it ended, and remember for ``asked``, begun at ``began_s``, where there is nothing left to do."""
    configuration = configuration_stamps(site.considered, pipeline)
    planner, settings = _planned(site, pipeline, until, overrides)
    forced = check_forced(planner.pipeline, force)
    check_armed(planner, armed=arm)
    record = begin(site.home, pipeline, overrides)
    with PlainLines() if as_json else observer() as view:
        Runner(planner, record, view, forced=forced).run()
    if as_json:
        render.document(record.document())
    else:
        render.summary(record, next_step(record))
    quick = not forced and record.outcome == "done" and not depends_on_surroundings(site, overrides)
    if quick and asked is not None:
        inputs = input_stamps(planner, settings, site.data_roots)
        plans = planner.plan()
        if inputs is not None and all(plan.result is not None for plan in plans):
            parts = {plan.spec.name: plan.parts for plan in plans}
            if configuration_stamps(site.considered, pipeline) == configuration:
                keep(asked, record, parts, {**configuration, **inputs}, began_s)
    return 0 if record.outcome == "done" else 1


def show_plan(
    site: Site, pipeline: str, until: str | None, overrides: list[str], force: list[str], *, as_json: bool
) -> None:
    """Which stages would run, and why."""
    planner, _ = _planned(site, pipeline, until, overrides)
    stages = planner.plan(check_forced(planner.pipeline, force))
    if as_json:
        render.document(render.plan_document(pipeline, overrides, stages))
    else:
        render.plan(stages)


def show_configuration(site: Site, overrides: list[str]) -> None:
    """The resolved configuration, checked, as YAML."""
    resolved = composed(site, overrides)
    build_settings(resolved)
    render.text(yaml.safe_dump(resolved, sort_keys=False, allow_unicode=True).rstrip())


def _planned(site: Site, pipeline: str, until: str | None, overrides: list[str]) -> tuple[Planner, dict[str, Any]]:
    declared = load_pipeline(pipeline, site.pipeline_folders).until(until)
    settings = build_settings(composed(site, [*declared.overrides, *overrides]))
    return Planner(Store(site.home), declared, settings, site.data_roots), settings
