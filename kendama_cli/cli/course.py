"""``kendama course``: exercises for students with a laptop and nothing else."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from kendama_cli.cli import render
from kendama_cli.cli.options import Home, Json
from kendama_cli.cli.sweep_view import failure_lines
from kendama_cli.cli.sweep_work import plan_combinations
from kendama_cli.config.folders import group_options
from kendama_cli.config.site import Site, find_site
from kendama_cli.course.board import OVERRIDES, Place, place_of, ranked
from kendama_cli.errors import UsageError
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.schema.settings import nearest


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
    render.table(rows, head=("", "learner", "rollouts to proof [95 %]", "unproven", "caught: mean / worst"))


def _row(one: Place) -> tuple[str, str, str, str]:
    interval = "" if one.interval is None else f" [{one.interval[0]:.0f}, {one.interval[1]:.0f}]"
    needed = f"{one.rollouts_to_proof:.0f}{interval}"
    return one.learner, needed, f"{one.unproven} of {one.seeds}", f"{one.caught_rate:.2f} / {one.worst_caught_rate:.2f}"


course_app = typer.Typer(help="Eight exercises, graded, and a board for learners of your own.", no_args_is_help=True)

Number = Annotated[int, typer.Argument(metavar="N", help="Which exercise, as 'kendama course list' numbers them.")]


@course_app.command("list")
def course_list(as_json: Json = False) -> None:
    """List the exercises with their tasks."""
    from kendama_cli.cli.course_work import list_exercises

    list_exercises(as_json=as_json)


@course_app.command("start")
def course_start(
    number: Number,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Where to write it [kendama-course].")
    ] = None,
    solutions: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="For teachers: fill the tasks in, from examples/course/solutions."),
    ] = None,
) -> None:
    """Write the notebook of an exercise; what is there already is never overwritten."""
    from kendama_cli.cli.course_work import start_exercise

    start_exercise(number, output or Path("kendama-course"), solutions)


@course_app.command("check")
def course_check(
    number: Number,
    notebook: Annotated[
        Path | None, typer.Argument(metavar="[NOTEBOOK]", help="The notebook [kendama-course/N-*.ipynb].")
    ] = None,
    timeout_s: Annotated[
        float, typer.Option("--timeout", metavar="SECONDS", min=1.0, help="How long the notebook may take.")
    ] = 900.0,
    as_json: Json = False,
) -> int:
    """Run the cells of a notebook from the first to the last, and say which tasks are solved."""
    from kendama_cli.cli.course_work import check_exercise

    return check_exercise(number, notebook, timeout_s, as_json=as_json)


@course_app.command("board")
def course_board(
    learners: Annotated[
        list[str] | None, typer.Argument(metavar="[LEARNER]...", help="Which learners [all that are installed].")
    ] = None,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="How many seeds each learner has.")] = 10,
    first_seed: Annotated[int, typer.Option(metavar="SEED", min=0, help="The first of them.")] = 500,
    task: Annotated[str, typer.Option(metavar="TASK", help="What has to be learned (learn/task).")] = "hard",
    as_json: Json = False,
    home: Home = None,
) -> int:
    """Rank learners by the rollouts that they need to a proven swing-up, on the rail."""
    from kendama_cli.cli.course import show_board

    return show_board(find_site(home), learners or [], range(first_seed, first_seed + seeds), task, as_json=as_json)
