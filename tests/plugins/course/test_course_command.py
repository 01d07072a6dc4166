"""``kendama course`` as it is typed."""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

from kendama_cli.errors import UsageError
from kendama_cli.plugins.course.board import Place, place_of, ranked
from kendama_cli.plugins.course.checks import exercise_8
from kendama_cli.plugins.course.notebook import Cell, as_notebook, read_notebook, without_magics
from kendama_cli.plugins.course.work import Work, WrongAnswerError
from tests import warm_command
from tests.documented_package import declare_installed
from tests.plugins.course.work_of_students import COURSE, EXERCISES, solved_cells


def kendama(folder: Path, *words: str, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **({"PYTHONPATH": str(path)} if path else {})}
    return warm_command.kendama(["course", *words], folder, environment, 240)


def test_the_list_names_every_exercise_with_its_tasks(tmp_path: Path) -> None:
    found = json.loads(kendama(tmp_path, "list", "--json").stdout)
    assert [one["number"] for one in found] == list(range(1, 9))
    assert found[3]["tasks"]["5"] == "The baseline"
    assert "SARSA by hand" in kendama(tmp_path, "list").stdout


def test_an_exercise_is_started_once_and_handed_in_empty(tmp_path: Path) -> None:
    assert kendama(tmp_path, "start", "6").stdout == "kendama-course/6-seeing-the-catch.ipynb\n"
    again = kendama(tmp_path, "start", "6")
    assert again.returncode == 2
    assert "is there already and stays as it is" in again.stderr
    checked = kendama(tmp_path, "check", "6", "--json")
    assert checked.returncode == 1
    document = json.loads(checked.stdout)
    assert [one["solved"] for one in document["tasks"]] == [False] * 6
    assert document["tasks"][0]["line"] == "project() gives nothing yet: fill it in, and return the result"
    assert document["failures"], "cells that need what is missing"


def test_a_solved_notebook_is_graded_in_a_process_of_its_own(tmp_path: Path) -> None:
    started = kendama(tmp_path, "start", "6", "-o", "solved", "--solutions", str(COURSE / "solutions"))
    assert started.returncode == 0, started.stderr
    checked = kendama(tmp_path, "check", "6", "solved/6-seeing-the-catch.ipynb")
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert checked.stdout.endswith("exercise 6: 6 of 6 tasks solved\n")


def test_a_notebook_without_an_end_is_stopped(tmp_path: Path) -> None:
    (tmp_path / "endless.ipynb").write_text(as_notebook([Cell(True, "while True:\n    pass")]))
    done = kendama(tmp_path, "check", "6", "endless.ipynb", "--timeout", "3")
    assert done.returncode == 1
    assert done.stderr == (
        "kendama: endless.ipynb took longer than 3 s; look for an endless loop, or allow more (--timeout)\n"
    )


def test_a_notebook_that_ends_its_process_is_told(tmp_path: Path) -> None:
    (tmp_path / "gone.ipynb").write_text(as_notebook([Cell(True, "import os\nos._exit(3)")]))
    done = kendama(tmp_path, "check", "6", "gone.ipynb")
    assert (done.returncode, done.stderr) == (
        1,
        "kendama: gone.ipynb could not be graded: its process ended with code 3\n",
    )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("start", "9"), "there is no exercise 9; allowed: 1, 2, 3, 4, 5, 6, 7, 8"),
        (("check", "2"), "no such notebook; 'kendama course start 2' writes it"),
        (
            ("start", "2", "--solutions", "."),
            "no 2-movement-primitives.md there; name the folder examples/course/solutions",
        ),
        (
            ("board", "random_replay", "sarsas"),
            "there is no learner 'sarsas'; allowed: agent, bayes, clone",
        ),
        (("board", "random_replay", "seed=3"), "there is no learner 'seed=3'; allowed: agent, bayes, "),
        (("board", "--task", "no"), "there is no task 'no'; allowed: easy, hard, hard_random, paper"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(words: tuple[str, ...], line: str, tmp_path: Path) -> None:
    done = kendama(tmp_path, *words)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert line in done.stderr


def test_what_is_no_notebook_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.ipynb").write_text("hello")
    with pytest.raises(UsageError, match="is no notebook"):
        read_notebook(tmp_path / "text.ipynb")


def test_a_notebook_comes_back_as_it_was_written(tmp_path: Path) -> None:
    cells = EXERCISES[1].cells
    (tmp_path / "one.ipynb").write_text(as_notebook(cells))
    assert read_notebook(tmp_path / "one.ipynb") == cells
    assert without_magics(Cell(True, "%matplotlib inline\n!ls\nx = 5 % 2")).text == "\n\nx = 5 % 2"


def test_the_board_ranks_by_rollouts_to_solved_and_then_by_what_the_policies_catch() -> None:
    def metrics(needed: int, caught: float) -> dict[str, object]:
        return {"rollouts_to_solved": needed, "solved": needed < 1000, "frozen_caught_rate": caught}

    good = place_of("good", [metrics(100, 1.0), metrics(140, 0.9)])
    assert good == Place("good", 2, 120.0, None, 120.0, good.mean_interval, 0, 0.95, 0.9)
    assert good.mean_interval is not None
    poor, poorer = (place_of(name, [metrics(1000, share)]) for name, share in (("poor", 0.5), ("poorer", 0.1)))
    assert [one.learner for one in ranked([poorer, good, poor])] == ["good", "poor", "poorer"]
    assert (poor.unsolved, poor.mean_interval) == (1, None)


def test_the_board_runs_every_learner_on_every_seed_and_keeps_the_runs(tmp_path: Path) -> None:
    words = ("board", "random_replay", "sarsa", "--task", "easy", "--seeds", "2", "--json")
    document = json.loads(kendama(tmp_path, *words).stdout)
    places = {one["learner"]: one for one in document["places"]}
    assert {name: one["seeds"] for name, one in places.items()} == {"random_replay": 2, "sarsa": 2}
    again = kendama(tmp_path, "board", "random_replay", "sarsa", "--task", "easy", "--seeds", "2")
    assert again.stderr.count(": cached") == 4
    assert again.stdout.splitlines()[1].split()[:2] == ["1", document["places"][0]["learner"]]


@pytest.fixture(scope="module")
def own_learner(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Exercise 8 as it is started, its package as if it were installed."""
    folder = tmp_path_factory.mktemp("eight")
    assert kendama(folder, "start", "8", "-o", ".").returncode == 0
    declare_installed(folder / "my-learner", "my_learner", {"kendama.learners": "mine = my_learner:LEARNER"})
    return folder


def test_the_learner_of_exercise_8_is_not_there_before_it_is_installed(tmp_path: Path) -> None:
    for check in exercise_8.CHECKS.values():
        with pytest.raises(WrongAnswerError, match="run 'pip install -e my-learner'"):
            check(Work({}, tmp_path))


@pytest.mark.slow
def test_exercise_8_as_it_is_started_fails_in_every_task(tmp_path: Path) -> None:
    kendama(tmp_path, "start", "8", "-o", ".")
    tasks = json.loads(kendama(tmp_path, "check", "8", "8-your-own-learner.ipynb", "--json").stdout)["tasks"]
    assert [one["solved"] for one in tasks] == [False] * 3
    assert "run 'pip install -e my-learner'" in tasks[0]["line"]


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_learner_that_proposes_nothing_is_plugged_in_and_fails_and_the_solution_beats_chance(
    own_learner: Path,
) -> None:
    search = own_learner / "my-learner" / "my_learner" / "search.py"
    check = ("check", "8", "8-your-own-learner.ipynb", "--json")
    empty = json.loads(kendama(own_learner, *check, path=search.parents[1]).stdout)["tasks"]
    assert [one["solved"] for one in empty] == [True, False, False]
    assert "write propose()" in empty[1]["line"]
    page = (COURSE / "solutions" / "8-your-own-learner.md").read_text()
    answer = re.search(r"```python\n# my_learner/search.py\n(.*?)```", page, re.DOTALL)
    assert answer is not None
    search.write_text(answer.group(1))
    done = json.loads(kendama(own_learner, *check, path=search.parents[1]).stdout)["tasks"]
    assert [one["line"] for one in done] == ["", "", ""]


@pytest.mark.parametrize(
    "number", [pytest.param(n, marks=() if n == 6 else pytest.mark.slow) for n in sorted(EXERCISES) if n != 8]
)
@pytest.mark.timeout(900)
def test_jupyter_itself_executes_the_solved_notebook(number: int, tmp_path: Path) -> None:
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    book = nbformat.reads(as_notebook(solved_cells(EXERCISES[number])), as_version=4)
    nbformat.validate(book)
    nbclient.NotebookClient(book, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert any(cell.get("outputs") for cell in book.cells)
