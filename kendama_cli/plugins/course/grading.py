"""Grader of a notebook's cells: ``python -m kendama_cli.plugins.course.grading NOTEBOOK N RESULT``.

The cells run in the order in which they stand, in one namespace that nothing was in before, so that what is graded is
what the notebook says and not what was once typed in it. A cell that fails does not end this: the tasks that do not
need it count all the same.
"""

from __future__ import annotations

import dataclasses
import importlib
import json
import os
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.plugins.course.notebook import Cell, Exercise, find_exercises, read_notebook, without_magics
from kendama_cli.plugins.course.work import Work, WrongAnswerError

Check = Callable[[Work], None]


@dataclass(frozen=True)
class Grade:
    """One task: whether it is solved, and what helps where it is not."""

    task: int
    title: str
    solved: bool
    line: str


@dataclass(frozen=True)
class Graded:
    """A notebook's grades, and the cells that failed: (number among all cells, error)."""

    grades: tuple[Grade, ...]
    failures: tuple[tuple[int, str], ...]


def checks_of(number: int) -> Mapping[int, Check]:
    """Return the checks of exercise ``number`` by task."""
    module = importlib.import_module(f"kendama_cli.plugins.course.checks.exercise_{number}")
    found: Mapping[int, Check] = module.CHECKS
    return found


def run_cells(cells: Sequence[Cell]) -> tuple[dict[str, Any], list[tuple[int, str]]]:
    """Run the cells; return the names that they define, and those that failed."""
    names: dict[str, Any] = {"__name__": "__main__", "display": print}
    failures = []
    for number, cell in enumerate(cells, 1):
        if not cell.code:
            continue
        try:
            exec(compile(without_magics(cell).text, f"cell {number}", "exec"), names)
        except Exception as error:
            line = traceback.extract_tb(error.__traceback__)
            at = next((f", line {one.lineno}" for one in line if one.filename == f"cell {number}"), "")
            failures.append((number, f"{type(error).__name__}: {error}{at}"))
    return names, failures


def grade(exercise: Exercise, names: Mapping[str, Any], folder: Path) -> tuple[Grade, ...]:
    """Grade every task of the exercise by what the cells defined."""
    work = Work(names, folder)
    return tuple(_graded(task, title, checks_of(exercise.number)[task], work) for task, title in exercise.tasks.items())


def _graded(task: int, title: str, check: Check, work: Work) -> Grade:
    try:
        check(work)
    except WrongAnswerError as error:
        return Grade(task, title, False, " ".join(str(error).split()))
    return Grade(task, title, True, "")


def main(notebook: Path, number: int, result: Path) -> None:
    """Grade ``notebook`` as exercise ``number``, and write what came of it to ``result`` as JSON."""
    (exercise,) = (one for one in find_exercises() if one.number == number)
    notebook, result = notebook.resolve(), result.resolve()
    os.chdir(notebook.parent)
    sys.path.insert(0, str(notebook.parent))
    names, failures = run_cells(read_notebook(notebook))
    graded = Graded(grade(exercise, names, notebook.parent), tuple(failures))
    result.write_text(json.dumps(dataclasses.asdict(graded)))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
