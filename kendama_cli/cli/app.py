"""The commands: each reads its options, asks the rooms below, and hands the answer to ``render``."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Annotated, Any

import typer

import kendama_cli
from kendama_cli.cli import completion, render
from kendama_cli.config.compose import composed, composed_each, expand_sweep
from kendama_cli.config.site import Site, find_site
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.catalogue import Pipeline, load_pipeline
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.plan import Planner, check_armed, check_forced
from kendama_cli.pipeline.record import RunRecord, begin, find_run, past_runs
from kendama_cli.pipeline.runner import Runner
from kendama_cli.settings.nodes import build_settings
from kendama_cli.store.store import Store

app = typer.Typer(
    name="kendama",
    help="Teach a robot the ball-in-a-cup game: from a person's recorded swing to an arm that catches.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
cache_app = typer.Typer(help="Look after the store of finished work.", no_args_is_help=True)
log_app = typer.Typer(help="Look into MCAP logs.", no_args_is_help=True)
robot_app = typer.Typer(help="Robots as processes of their own.", no_args_is_help=True)
app.add_typer(cache_app, name="cache")
app.add_typer(log_app, name="log")
app.add_typer(robot_app, name="robot")

Home = Annotated[
    Path | None, typer.Option("--home", metavar="DIR", help="Store, runs and logs [KENDAMA_HOME, else .kendama].")
]
ConfigDir = Annotated[
    Path | None, typer.Option("--config-dir", metavar="DIR", help="A folder with conf/ and pipelines/ of your own.")
]
PipelineName = Annotated[
    str,
    typer.Option("-p", "--pipeline", metavar="PIPELINE", help="Pipeline to run.", autocompletion=completion.pipelines),
]
Until = Annotated[
    str | None,
    typer.Option(metavar="STAGE", help="Stop after this stage.", autocompletion=completion.stages),
]
Force = Annotated[
    list[str] | None,
    typer.Option(
        metavar="STAGE", help="Compute this stage again even where it is cached.", autocompletion=completion.stages
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]
Arm = Annotated[bool, typer.Option("--arm", help="Allow stages that move real hardware.")]
Overrides = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[OVERRIDE]...", help="KEY=VALUE of the configuration.", autocompletion=completion.overrides
    ),
]


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
    from kendama_cli.cli.progress import PlainLines, observer  # noqa: PLC0415  (rich, only where something is shown)

    site = find_site(home, config_dir)
    planner = _planner(site, pipeline, until, overrides or [])
    forced = check_forced(planner.pipeline, force or [])
    check_armed(planner, armed=arm)
    record = begin(site.home, pipeline, overrides or [])
    with PlainLines() if as_json else observer() as view:
        Runner(planner, record, view, forced=forced).run()
    if as_json:
        render.document(record.document())
    else:
        render.summary(record, f"see it with: kendama report {record.run}")
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
    import yaml  # noqa: PLC0415

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
    from kendama_cli.pipeline.report import write_report  # noqa: PLC0415  (matplotlib and pandas)

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
    from kendama_cli.cli.progress import PlainLines  # noqa: PLC0415
    from kendama_cli.pipeline.sweep import SweepJob, distinct, run_sweep  # noqa: PLC0415

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
        from kendama_cli.pipeline.report import write_report  # noqa: PLC0415

        render.note(f"report: {write_report([record.document() for record in records], report)}")
    return 0 if all(record.outcome == "done" for record in records) else 1


@cache_app.command("ls")
def cache_ls(as_json: Json = False, home: Home = None) -> None:
    """List what is stored: stage, key, size, artifact, metrics."""
    entries = Store(find_site(home).home).entries()
    if as_json:
        render.document([{**dataclasses.asdict(item), "artifact": str(item.artifact)} for item in entries])
        return
    rows = [
        (item.stage, item.key[:12], _size(item.artifact), item.artifact.name[:12], render.figures(item.metrics, 3))
        for item in entries
    ]
    render.table(rows, head=("stage", "key", "size", "artifact", "metrics"))


@cache_app.command("verify")
def cache_verify(as_json: Json = False, home: Home = None) -> int:
    """Read every stored byte and name what is damaged; damaged work is computed again when it is next needed."""
    damage = Store(find_site(home).home).verify()
    if as_json:
        render.document({"damaged": [{"path": str(item.path), "problem": item.problem} for item in damage]})
    elif damage:
        for item in damage:
            render.text(f"{item.path}: {item.problem}")
        render.error(f"{len(damage)} damaged; 'kendama cache gc' removes them, 'kendama run' computes them again")
    else:
        render.text("every byte is as it was written")
    return 1 if damage else 0


@cache_app.command("gc")
def cache_gc(
    keep_runs: Annotated[
        int | None, typer.Option(metavar="N", min=0, help="Forget all but the newest N runs and what only they used.")
    ] = None,
    home: Home = None,
) -> None:
    """Delete damaged entries, artifacts that nothing names, and what killed runs left behind."""
    gone = Store(find_site(home).home).collect_garbage(keep_runs)
    for path in gone:
        render.text(f"deleted {path}")
    render.text(f"{len(gone)} deleted")


@log_app.command("info")
def log_info(file: Annotated[Path, typer.Argument(metavar="FILE")], as_json: Json = False) -> None:
    """Say what an MCAP log holds."""
    from kendama_cli.log.export import describe  # noqa: PLC0415  (pandas)

    facts = describe(file)
    if as_json:
        render.document(facts)
    else:
        _show_log(facts)


@log_app.command("export")
def log_export(
    file: Annotated[Path, typer.Argument(metavar="FILE")],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="FILE.parquet or FILE.csv [FILE's name .parquet]."),
    ] = None,
    topic: Annotated[str | None, typer.Option(metavar="TOPIC", help="Only this topic.")] = None,
) -> None:
    """Export an MCAP log to Parquet or CSV."""
    from kendama_cli.log.export import export  # noqa: PLC0415  (pandas and pyarrow)

    for path in export(file, output or Path(file.name).with_suffix(".parquet"), topic):
        render.text(str(path))


@robot_app.command("twin")
def robot_twin(
    overrides: Overrides = None,
    host: Annotated[str, typer.Option(help="Address to bind; loopback unless you say otherwise.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="UDP port; 0 takes a free one.")] = 0,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> None:
    """Run the simulated robot as a process of its own, behind UDP, until it is stopped."""
    from kendama_cli.blocks.robot.twin import serve_twin  # noqa: PLC0415  (dartpy)

    site = find_site(home, config_dir)
    settings = build_settings(composed(site, overrides or []))
    if settings["hardware"].kind != "twin":
        raise UsageError(f"hardware is '{settings['hardware'].kind}'; a twin needs hardware=twin")
    robot = resolve_files(settings["robot"], "robot", site.data_roots)
    serve_twin(robot, settings["game"], settings["hardware"], host=host, port=port, on_ready=render.line)


@app.command()
def doctor(as_json: Json = False) -> int:
    """Say what is installed, what is missing, and what each optional part would need."""
    from kendama_cli.cli.doctor import examine  # noqa: PLC0415  (tries every import)

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
    declared = _declared(site, pipeline, until)
    settings = build_settings(composed(site, [*declared.overrides, *overrides]))
    return Planner(Store(site.home), declared, settings, site.data_roots)


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


def _show_log(facts: dict[str, Any]) -> None:
    render.text(f"{facts['path']}: {facts['messages']} messages, {facts['duration_s']:.3f} s")
    rows = [(item["topic"], item["schema"], str(item["messages"])) for item in facts["channels"]]
    render.table(rows, head=("topic", "schema", "messages"))


def _size(folder: Path) -> str:
    size = sum(file.stat().st_size for file in folder.iterdir())
    return f"{size / 1e6:.2f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"
