"""``kendama course``: exercises for students with a laptop and nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kendama_cli.cli.options import Home, Json
from kendama_cli.config.site import find_site

SECTION = "Teach"
"""Part of ``kendama --help`` in which these commands stand."""

course_app = typer.Typer(help="Eight exercises, graded, and a board for learners of your own.", no_args_is_help=True)

Number = Annotated[int, typer.Argument(metavar="N", help="Number of the exercise in 'kendama course list'.")]


@course_app.command("list")
def course_list(as_json: Json = False) -> None:
    """List the exercises with their tasks.

    Example: kendama course list
    """
    from kendama_cli.plugins.course.exercises import list_exercises

    list_exercises(as_json=as_json)


@course_app.command("start")
def course_start(
    number: Number,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder to write it to [kendama-course].")
    ] = None,
    solutions: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="For teachers: fill the tasks in, from examples/course/solutions."),
    ] = None,
) -> None:
    """Write the notebook of an exercise; what is there already is never overwritten.

    Example: kendama course start 1
    """
    from kendama_cli.plugins.course.exercises import start_exercise

    start_exercise(number, output or Path("kendama-course"), solutions)


@course_app.command("check")
def course_check(
    number: Number,
    notebook: Annotated[
        Path | None, typer.Argument(metavar="[NOTEBOOK]", help="The notebook [kendama-course/N-*.ipynb].")
    ] = None,
    timeout_s: Annotated[
        float, typer.Option("--timeout", metavar="SECONDS", min=1.0, help="Time limit of the notebook.")
    ] = 900.0,
    as_json: Json = False,
) -> int:
    """Run the cells of a notebook from the first to the last, and say which tasks are solved.

    Example: kendama course check 1
    """
    from kendama_cli.plugins.course.exercises import check_exercise

    return check_exercise(number, notebook, timeout_s, as_json=as_json)


@course_app.command("board")
def course_board(
    learners: Annotated[
        list[str] | None, typer.Argument(metavar="[LEARNER]...", help="Names of learners [all that are installed].")
    ] = None,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Number of seeds of each learner.")] = 10,
    first_seed: Annotated[int, typer.Option(metavar="SEED", min=0, help="The first of them.")] = 500,
    task: Annotated[str, typer.Option(metavar="TASK", help="Task to be learned (learn/task).")] = "hard",
    as_json: Json = False,
    home: Home = None,
) -> int:
    """Rank learners by the rollouts that they need to a solved swing-up, on the rail.

    Example: kendama course board sarsa random_replay
    """
    from kendama_cli.plugins.course.board import show_board

    return show_board(find_site(home), learners or [], range(first_seed, first_seed + seeds), task, as_json=as_json)
