"""Notebooks as students hand them in: empty, solved, and with one task answered wrongly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kendama_cli.plugins.course.grading import Grade, grade, run_cells
from kendama_cli.plugins.course.notebook import Cell, Exercise, find_exercises, solved

COURSE = Path(__file__).resolve().parents[3] / "examples" / "course"
EXERCISES = {one.number: one for one in find_exercises()}
QUICK = {
    1: (1, 2, 3, 4),
    2: (1, 2, 3, 4, 5),
    3: (1, 2, 3, 5),
    4: (1, 2, 3),
    5: (2, 3),
    6: (1, 2, 3, 4, 5, 6),
    7: (1, 2, 3, 7),
}
"""Tasks whose solutions and checks take seconds; the others are graded by the slow tests."""


def solved_cells(exercise: Exercise) -> list[Cell]:
    """The notebook with every task answered."""
    return solved(exercise.cells, (COURSE / "solutions" / exercise.path.name).read_text())


def quick_cells(cells: list[Cell], tasks: tuple[int, ...]) -> list[Cell]:
    """The cells without demonstrations of what was solved: the beginning, the tasks, and what defines something."""
    first = next(i for i, cell in enumerate(cells) if cell.task is not None)
    return [
        cell
        for i, cell in enumerate(cells)
        if cell.code
        and not cell.text.startswith("# long")
        and (i < first or (cell.task in tasks if cell.task is not None else _defines(cell)))
    ]


def _defines(cell: Cell) -> bool:
    first = cell.text.partition("\n")[0]
    return first.startswith(("def ", "class ", "# given")) or first.partition(" ")[0].isupper()


def run(cells: list[Cell]) -> dict[str, Any]:
    """The names that the cells define; none of them may fail."""
    names, failures = run_cells(cells)
    assert failures == []
    return names


def graded(number: int, names: dict[str, Any], folder: Path) -> dict[int, Grade]:
    """Every task's grade."""
    return {one.task: one for one in grade(EXERCISES[number], names, folder)}
