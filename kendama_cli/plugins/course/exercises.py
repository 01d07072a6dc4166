"""Commands list, start and check of the course."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from kendama_cli.cli import render
from kendama_cli.errors import KendamaError, UsageError
from kendama_cli.plugins.course.notebook import Exercise, as_notebook, find_exercises, solved


def list_exercises(*, as_json: bool) -> None:
    """List number, title, time and tasks of every exercise."""
    found = find_exercises()
    if as_json:
        render.document(
            [
                {"number": one.number, "title": one.title, "minutes": one.minutes, "tasks": dict(one.tasks)}
                for one in found
            ]
        )
        return
    rows = [(str(one.number), f"{one.minutes} min", one.title, f"{len(one.tasks)} tasks") for one in found]
    render.table(rows, head=("N", "time", "exercise", "tasks"))
    render.note("begin one with: kendama course start N")


def start_exercise(number: int, folder: Path, solutions: Path | None) -> None:
    """Write the notebook, and the files that belong to it, below ``folder``."""
    exercise = _exercise(number)
    cells = exercise.cells
    if solutions is not None:
        page = solutions / exercise.path.name
        if not page.is_file():
            raise UsageError(
                f"--solutions {solutions}: no {exercise.path.name} there; name the folder examples/course/solutions"
            )
        cells = solved(cells, page.read_text())
    place = folder / f"{exercise.path.stem}.ipynb"
    beside = exercise.path.with_suffix("")
    files = {
        folder / path.relative_to(beside): path
        for path in sorted(beside.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }
    for one in (place, *files):
        if one.exists():
            raise UsageError(f"{one} is there already and stays as it is; name another folder with -o, or move it away")
    try:
        for one, origin in files.items():
            one.parent.mkdir(parents=True, exist_ok=True)
            one.write_bytes(origin.read_bytes())
        folder.mkdir(parents=True, exist_ok=True)
        place.write_text(as_notebook(cells))
    except OSError as error:
        raise KendamaError(f"--output {folder}: {error.strerror}; name a folder that can be written") from None
    render.text(str(place))
    render.note(f"open it with: jupyter lab {place} (extra 'course'); then: kendama course check {number} {place}")


def check_exercise(number: int, notebook: Path | None, timeout_s: float, *, as_json: bool) -> int:
    """Grade a notebook in a process of its own; 1 where a task is not solved."""
    exercise = _exercise(number)
    place = notebook or Path("kendama-course") / f"{exercise.path.stem}.ipynb"
    graded = _graded(exercise, place, timeout_s)
    tasks, failures = graded["grades"], graded["failures"]
    if as_json:
        render.document({"exercise": number, "notebook": str(place), "tasks": tasks, "failures": failures})
    else:
        for cell, line in failures:
            render.note(f"cell {cell} failed: {line}")
        render.table(
            [
                (f"task {one['task']}", "solved" if one["solved"] else "not yet", one["line"] or one["title"])
                for one in tasks
            ]
        )
        done = sum(one["solved"] for one in tasks)
        render.text(f"exercise {number}: {done} of {len(tasks)} tasks solved")
    return 0 if all(one["solved"] for one in tasks) else 1


def _exercise(number: int) -> Exercise:
    found = {one.number: one for one in find_exercises()}
    if number not in found:
        raise UsageError(f"there is no exercise {number}; allowed: {', '.join(map(str, found))}")
    return found[number]


def _graded(exercise: Exercise, notebook: Path, timeout_s: float) -> dict[str, Any]:
    """Run kendama_cli/plugins/course/grading.py and return its result; cells print to standard error."""
    if not notebook.is_file():
        raise UsageError(f"{notebook}: no such notebook; 'kendama course start {exercise.number}' writes it")
    with tempfile.TemporaryDirectory() as scratch:
        result = Path(scratch) / "result.json"
        words = [
            sys.executable,
            "-m",
            "kendama_cli.plugins.course.grading",
            str(notebook),
            str(exercise.number),
            str(result),
        ]
        try:
            done = subprocess.run(
                words, env={**os.environ, "MPLBACKEND": "Agg"}, stdout=sys.stderr, timeout=timeout_s, check=False
            )
        except subprocess.TimeoutExpired:
            raise KendamaError(
                f"{notebook} took longer than {timeout_s:g} s; look for an endless loop, or allow more (--timeout)"
            ) from None
        if not result.is_file():
            raise KendamaError(f"{notebook} could not be graded: its process ended with code {done.returncode}")
        graded: dict[str, Any] = json.loads(result.read_text())
    return graded
