"""The commands: each declares its options and hands them on; what does the work is imported when it is asked for.

So ``--help``, and a word that is completed, cost little more than the parser.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kendama_cli.cli import completion, options, render
from kendama_cli.cli.groups import open_group
from kendama_cli.cli.options import Arm, ConfigDir, Force, Home, Json, On, Overrides, PipelineName, Thorough, Until
from kendama_cli.cli.robot import robot_app
from kendama_cli.cli.runs import diff, runs_app
from kendama_cli.cli.settings import config
from kendama_cli.cli.setup import setup_app
from kendama_cli.cli.tools import cache_app, log_app
from kendama_cli.config.site import find_site
from kendama_cli.errors import UsageError
from kendama_cli.schema.registry import brought

if TYPE_CHECKING:
    from kendama_cli.pipeline.command_cache import CommandKey


app = typer.Typer(
    name="kendama",
    cls=open_group(),
    help="Teach a robot the ball-in-a-cup game: from a recorded swing to an arm that catches.",
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.add_typer(cache_app, name="cache")
app.add_typer(
    typer.Typer(cls=open_group("camera"), help="Calibrate cameras, and check what they see.", no_args_is_help=True),
    name="camera",
)
app.add_typer(log_app, name="log")
app.add_typer(robot_app, name="robot")
app.add_typer(runs_app, name="runs")
app.add_typer(setup_app, name="setup")
app.command()(config)
app.command()(diff)
USAGE = 2
WIDTHS = (
    "Width of exported figures [88, wide ones 182]. Columns: IEEE 88 and 182, Nature 89 and 183, Elsevier 90 and 190, "
    "Science 57 and 121, Springer 84 and 174, LNCS 122."
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from kendama_cli.cli.version_line import version_text

        render.text(version_text())
        raise typer.Exit


@app.callback()
def before_any_command(
    context: typer.Context,
    home: Home = None,
    config_dir: ConfigDir = None,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Version, commit and libraries.")
    ] = False,
) -> None:
    # given before the command, these hold unless the command has its own
    if home is not None:
        os.environ["KENDAMA_HOME"] = str(home)
    if config_dir is not None:
        os.environ["KENDAMA_CONFIG_DIR"] = str(config_dir)
    if context.invoked_subcommand is None:
        from kendama_cli.cli.welcome import welcome

        welcome(find_site())


@app.command()
def run(
    context: typer.Context,
    overrides: Overrides = None,
    pipeline: PipelineName = "kendama",
    until: Until = None,
    force: Force = None,
    on: On = None,
    thorough: Thorough = False,
    arm: Arm = False,
    watch: Annotated[bool, typer.Option("--watch", help="Show the run in the browser while it goes on.")] = False,
    port: Annotated[
        int, typer.Option(metavar="N", min=0, max=65535, help="Port of that page, on loopback; 0 takes a free one.")
    ] = 0,
    show: Annotated[bool, typer.Option("--show/--no-show", help="Open that page, or only print its address.")] = True,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> int:
    """Run a pipeline; what is cached is not computed again.

    Example: kendama run -p imitation robot=iiwa
    """
    began_s = time.time()
    from kendama_cli.cli.run_work import run_pipeline

    watcher = brought("--watch", "kendama.watchers", "page")(port, show=show) if watch else None
    return run_pipeline(
        find_site(home, config_dir),
        pipeline,
        until,
        options.words(overrides, thorough=thorough),
        force or [],
        on=on,
        asked=context.obj,
        began_s=began_s,
        arm=arm,
        as_json=as_json,
        watcher=watcher,
    )


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
    """Show the stages that would run, and why.

    Example: kendama plan learn.alpha=0.5
    """
    from kendama_cli.cli.run_work import show_plan

    show_plan(find_site(home, config_dir), pipeline, until, overrides or [], force or [], as_json=as_json)


@app.command()
def report(
    runs: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[RUN]...",
            help="Ids or numbers of runs, ranges 1..40, sweep:NAME, or last; the newest run if left out. Several are "
            "compared in one page.",
            autocompletion=completion.selections,
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="File to write the page to.")
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Instead of a page, every figure as SVG, PDF, PNG, CSV and TeX with its caption, every table as CSV "
            "and TeX, README.txt and methods.md.",
        ),
    ] = None,
    width_mm: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            min=40,
            max=400,
            help=WIDTHS,
        ),
    ] = None,
    video: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Instead of a page, a video (.webm or .mp4), slow around the catch; it resumes."
        ),
    ] = None,
    home: Home = None,
) -> None:
    """Make a self-contained HTML page from the logs of a run, or of several beside each other.

    Example: kendama report last -o report.html
    """
    from kendama_cli.pipeline.report import ReportRequest, report_form, write_report  # pandas
    from kendama_cli.pipeline.run_selection import select_runs

    folder = find_site(home).home
    records = select_runs(folder, runs or [])
    if video is not None:
        told = report_form("--video", "video")(ReportRequest(records, video, folder, width_mm))
    elif export is not None:
        told = report_form("--export", "figures")(ReportRequest(records, export, folder, width_mm))
    else:
        told = str(write_report(records, output))
    render.text(told)


@app.command()
def sweep(
    overrides: Overrides = None,
    pipeline: PipelineName = "kendama",
    until: Until = None,
    jobs: Annotated[
        int | None, typer.Option("-j", "--jobs", metavar="N", min=1, help="Runs at once [one per core].")
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Name of the sweep, for sweep:NAME [the date and the keys that vary]."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write one page that compares all runs, when they have ended.")
    ] = None,
    on: On = None,
    thorough: Thorough = False,
    as_json: Json = False,
    home: Home = None,
    config_dir: ConfigDir = None,
) -> int:
    """Run every combination of overrides such as learn.alpha=0.3,0.5 or 'seed=range(0,10)'.

    Example: kendama sweep learn.alpha=0.3,0.5 'seed=range(0,10)'
    """
    from kendama_cli.cli.sweep_work import sweep_pipeline

    site = find_site(home, config_dir)
    words = options.words(overrides, thorough=thorough)
    return sweep_pipeline(site, pipeline, until, words, on=on, jobs=jobs, name=name, report=report, as_json=as_json)


def run_command(arguments: list[str], asked: CommandKey | None) -> int:
    """Parse and carry out the command line; its exit code. Raises UsageError for what typer does not take.

    ``asked`` is what ``run`` was asked, as it was before anything changed the environment.
    """
    if os.environ.get("_KENDAMA_COMPLETE") == "complete_bash":
        render.text(completion.in_bash(lambda: app(args=[], standalone_mode=False, prog_name="kendama")))
        return 0
    try:
        code = app(args=arguments, standalone_mode=False, prog_name="kendama", obj=asked)
    except typer.Abort:
        raise KeyboardInterrupt from None
    except typer.TyperException as error:
        if error.format_message().startswith("Usage:"):  # no command was given
            render.text(error.format_message())
            return USAGE
        from kendama_cli.cli.mistyped import mistake  # for a mistake alone

        raise UsageError(mistake(error, arguments)) from error
    return code if isinstance(code, int) else 0
