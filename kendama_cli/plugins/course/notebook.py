"""Exercises as text, and as the notebooks that students work in.

An exercise is a Markdown file; its blocks of Python are the notebook's cells of code. A cell whose first line is
``# Task N`` is a student's to fill in, and a file of solutions has a cell of the same first line for each.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kendama_cli.config.site import bundled_root
from kendama_cli.errors import UsageError

BLOCK = re.compile(r"^```python\n(.*?)^```\n?", re.MULTILINE | re.DOTALL)
TASK = re.compile(r"# Task (\d+)\b")
TITLE = re.compile(r"^# (\d+)\. (.+)$", re.MULTILINE)
TASK_TITLE = re.compile(r"^## Task (\d+): (.+)$", re.MULTILINE)
MINUTES = re.compile(r"^About (\d+) minutes\.", re.MULTILINE)


@dataclass(frozen=True)
class Cell:
    """One cell of a notebook: text, or code."""

    code: bool
    text: str

    @property
    def task(self) -> int | None:
        """Return the number of the task that a student answers here; None in every other cell."""
        found = TASK.match(self.text) if self.code else None
        return int(found.group(1)) if found else None


@dataclass(frozen=True)
class Exercise:
    """One exercise: its file, and what stands in it."""

    path: Path
    number: int
    title: str
    minutes: int
    tasks: Mapping[int, str]
    """What each task is called, by its number."""

    @property
    def cells(self) -> list[Cell]:
        """Return the cells of its notebook, in order."""
        return parted(self.path.read_text())


def find_exercises() -> list[Exercise]:
    """Find the exercises, by their number."""
    folder = bundled_root() / "examples" / "course" / "exercises"
    return sorted((_exercise(path) for path in folder.glob("[0-9]-*.md")), key=lambda one: one.number)


def parted(text: str) -> list[Cell]:
    """Split a Markdown page into cells."""
    cells, place = [], 0
    for block in BLOCK.finditer(text):
        cells += [Cell(False, text[place : block.start()].strip()), Cell(True, block.group(1).rstrip())]
        place = block.end()
    cells.append(Cell(False, text[place:].strip()))
    return [cell for cell in cells if cell.text]


def solved(cells: Sequence[Cell], solutions: str) -> list[Cell]:
    """Replace each task's cell by the cell of the page ``solutions`` that begins with the same ``# Task N``.

    Raises UsageError where a task has no solution.
    """
    answers = {cell.task: cell for cell in parted(solutions) if cell.task is not None}
    missing = [str(cell.task) for cell in cells if cell.task is not None and cell.task not in answers]
    if missing:
        raise UsageError(f"the solutions have nothing for task {', '.join(missing)}")
    return [cell if cell.task is None else answers[cell.task] for cell in cells]


def as_notebook(cells: Sequence[Cell]) -> str:
    """Return the cells as a Jupyter notebook, format 4.5."""
    made: list[dict[str, Any]] = [
        {
            "cell_type": "code" if cell.code else "markdown",
            "id": f"cell-{i}",
            "metadata": {},
            "source": cell.text.splitlines(keepends=True),
            **({"execution_count": None, "outputs": []} if cell.code else {}),
        }
        for i, cell in enumerate(cells)
    ]
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    document = {"cells": made, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def read_notebook(path: Path) -> list[Cell]:
    """Read the cells of the notebook at ``path``; raises UsageError for any other file."""
    try:
        document: Any = json.loads(path.read_text())
        return [Cell(cell["cell_type"] == "code", "".join(cell["source"])) for cell in document["cells"]]
    except FileNotFoundError:
        raise UsageError(f"{path}: no such notebook; 'kendama course start N' writes it") from None
    except (ValueError, KeyError, TypeError) as error:
        raise UsageError(f"{path} is no notebook ({error}); save it as .ipynb") from None


def without_magics(cell: Cell) -> Cell:
    """Return the cell as plain Python: lines that only Jupyter understands (``%...``, ``!...``) are left out."""
    lines = ["" if line.lstrip().startswith(("%", "!")) else line for line in cell.text.splitlines()]
    return replace(cell, text="\n".join(lines))


def _exercise(path: Path) -> Exercise:
    text = path.read_text()
    title, minutes = TITLE.search(text), MINUTES.search(text)
    if title is None or minutes is None:
        raise UsageError(f"{path}: an exercise begins with '# N. Title' and says 'About M minutes.'")
    tasks = {int(number): name for number, name in TASK_TITLE.findall(text)}
    return Exercise(path, int(title.group(1)), title.group(2), int(minutes.group(1)), tasks)
