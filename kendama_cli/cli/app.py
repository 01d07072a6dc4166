"""The commands: each reads its options, asks the packages below, and hands the answer to ``render``."""

from __future__ import annotations

import dataclasses
import os
import time
from pathlib import Path
from typing import Annotated, Any

import typer

import kendama_cli
from kendama_cli.cli import completion, render
from kendama_cli.cli.camera import camera_app
from kendama_cli.cli.motion import motion_app
from kendama_cli.cli.options import Arm, ConfigDir, Force, Home, Json, Overrides, PipelineName, Until
from kendama_cli.cli.repeat import next_step
from kendama_cli.cli.tools import cache_app, log_app, robot_app
from kendama_cli.config.compose import composed, composed_each, depends_on_surroundings, expand_sweep
from kendama_cli.config.site import Site, find_site
from kendama_cli.pipeline.catalogue import Pipeline, load_pipeline
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.pipeline.plan import Planner, check_armed, check_forced
from kendama_cli.pipeline.record import RunRecord, begin, find_run, past_runs
from kendama_cli.pipeline.runner import Runner
from kendama_cli.pipeline.unchanged import Question, keep
from kendama_cli.pipeline.watched import configuration_stamps, input_stamps
from kendama_cli.store.store import Store

app = typer.Typer(
    name="kendama",
    help="Teach a robot the ball-in-a-cup game: from a person's recorded swing to an arm that catches.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(cache_app, name="cache")
app.add_typer(camera_app, name="camera")
app.add_typer(log_app, name="log")
app.add_typer(motion_app, name="motion")
app.add_typer(robot_app, name="robot")


def _show_version(wanted: bool) -> None:
    if wanted:
        render.text(f"kendama {kendama_cli.__version__}")
        raise typer.Exit


@app.callback()
def before_any_command(
    home: Home = None,
    config_dir: ConfigDir = None,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    # given before the command, these hold unless the command has its own
    if home is not None:
        os.environ["KENDAMA_HOME"] = str(home)
    if config_dir is not None:
        os.environ["KENDAMA_CONFIG_DIR"] = str(config_dir)


@app.command()
def run(
    context: typer.Context,
    overrides: Overrides = None,
    pipeline: PipelineName = "kendama",
    until: Until = None,
    force: Force = None,
    arm: Arm = False,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> int:
    """Run a pipeline; what is cached is not computed again."""
    from kendama_cli.cli.progress import PlainLines, observer  # rich, only where something is shown

    began_s = time.time()
    site = find_site(home, config_dir)
    configuration = configuration_stamps(site.considered, pipeline)
    planner, settings = _planned(site, pipeline, until, overrides or [])
    forced = check_forced(planner.pipeline, force or [])
    check_armed(planner, armed=arm)
    record = begin(site.home, pipeline, overrides or [])
    with PlainLines() if as_json else observer() as view:
        Runner(planner, record, view, forced=forced).run()
    if as_json:
        render.document(record.document())
    else:
        render.summary(record, next_step(record))
    quick = not forced and record.outcome == "done" and not depends_on_surroundings(site, overrides or [])
    if quick and isinstance(context.obj, Question):
        inputs = input_stamps(planner, settings, site.data_roots)
        plans = planner.plan()
        if inputs is not None and all(plan.result is not None for plan in plans):
            parts = {plan.spec.name: plan.parts for plan in plans}
            if configuration_stamps(site.considered, pipeline) == configuration:
                keep(context.obj, record, parts, {**configuration, **inputs}, began_s)
    return 0 if record.outcome == "done" else 1


@app.command()
def plan(
    overrides: Overrides = None,
    pipeline: PipelineName = "kendama",
    until: Until = None,
    force: Force = None,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Say which stages would run, and why."""
    planner = _planner(find_site(home, config_dir), pipeline, until, overrides or [])
    stages = planner.plan(check_forced(planner.pipeline, force or []))
    if as_json:
        render.document(render.plan_document(pipeline, overrides or [], stages))
    else:
        render.plan(stages)


@app.command()
def config(overrides: Overrides = None, home: Home = None, config_dir: ConfigDir = None) -> None:
    """Print the resolved configuration as YAML."""
    import yaml

    resolved = composed(find_site(home, config_dir), overrides or [])
    build_settings(resolved)
    render.text(yaml.safe_dump(resolved, sort_keys=False, allow_unicode=True).rstrip())


@app.command()
def runs(as_json: Json = False, home: Home = None) -> None:
    """List past runs."""
    records = past_runs(find_site(home).home)
    if as_json:
        render.document(records)
        return
    rows = [
        (item["run"], item["started"], item["pipeline"], item["outcome"], " ".join(item["overrides"]))
        for item in records
    ]
    render.table(rows, head=("run", "started", "pipeline", "outcome", "overrides"))


@app.command()
def report(
    runs: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[RUN]...",
            help="Ids of runs; the newest if left out. Several are compared in one page.",
            autocompletion=completion.runs,
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Where to write the page.")
    ] = None,
    home: Home = None,
) -> None:
    """Make a self-contained HTML page from the logs of a run, or of several beside each other."""
    from kendama_cli.pipeline.report import write_report  # matplotlib and pandas

    folder = find_site(home).home
    names: list[str | None] = [*dict.fromkeys(runs)] if runs else [None]
    records = [find_run(folder, name) for name in names]
    render.text(str(write_report(records, output)))


@app.command()
def sweep(
    overrides: Overrides = None,
    pipeline: PipelineName = "kendama",
    until: Until = None,
    jobs: Annotated[
        int | None, typer.Option("-j", "--jobs", metavar="N", min=1, help="Runs at once [one per core].")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write one page that compares all runs, when they have ended.")
    ] = None,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> int:
    """Run every combination of overrides such as learn.alpha=0.3,0.5 or 'seed=range(0,10)'."""
    from kendama_cli.cli.progress import PlainLines
    from kendama_cli.pipeline.sweep import SweepJob, distinct, run_sweep

    site = find_site(home, config_dir)
    combinations = expand_sweep(site, overrides or [])
    declared = _declared(site, pipeline, until)
    configs = composed_each(site, [[*declared.overrides, *texts] for texts in combinations])
    store = Store(site.home)
    planners = (Planner(store, declared, build_settings(config), site.data_roots) for config in configs)
    wanted = distinct([SweepJob(texts, planner) for texts, planner in zip(combinations, planners, strict=True)])
    for job in wanted:
        check_armed(job.planner, armed=False)
    number = {id(job): f"[{i}/{len(wanted)} {' '.join(job.overrides)}] " for i, job in enumerate(wanted, 1)}
    records = run_sweep(wanted, lambda job, record: PlainLines(number[id(job)]), at_once=jobs or os.cpu_count() or 1)
    _show_sweep(records, as_json=as_json)
    if report is not None:
        from kendama_cli.pipeline.report import write_report

        render.note(f"report: {write_report([record.document() for record in records], report)}")
    return 0 if all(record.outcome == "done" for record in records) else 1


@app.command()
def doctor(as_json: Json = False) -> int:
    """Say what is installed, what is missing, and what each optional part would need."""
    from kendama_cli.cli.doctor import examine  # tries every import

    parts = examine()
    if as_json:
        render.document([dataclasses.asdict(part) for part in parts])
    else:
        render.table([(part.name, part.state, part.detail) for part in parts], head=("part", "state", "detail"))
    return 1 if any(part.state == "missing" for part in parts) else 0


def _declared(site: Site, pipeline: str, until: str | None) -> Pipeline:
    declared = load_pipeline(pipeline, site.pipeline_folders)
    return declared if until is None else declared.until(until)


def _planner(site: Site, pipeline: str, until: str | None, overrides: list[str]) -> Planner:
    return _planned(site, pipeline, until, overrides)[0]


def _planned(site: Site, pipeline: str, until: str | None, overrides: list[str]) -> tuple[Planner, dict[str, Any]]:
    declared = _declared(site, pipeline, until)
    settings = build_settings(composed(site, [*declared.overrides, *overrides]))
    return Planner(Store(site.home), declared, settings, site.data_roots), settings


def _show_sweep(records: list[RunRecord], *, as_json: bool) -> None:
    if as_json:
        render.document({"runs": [record.document() for record in records]})
        return
    rows = []
    for record in records:
        last = record.stages[-1] if record.stages else None
        shown = "" if last is None else last.error or f"{last.name}: {render.figures(last.metrics, 5)}"
        rows.append((record.run, record.outcome, " ".join(record.overrides), shown))
    render.table(rows, head=("run", "outcome", "overrides", "last stage"))
