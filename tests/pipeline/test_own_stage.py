"""A stage of another package, with an artifact, messages, a chapter and settings of its own, is one of ours."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest

from tests import warm_command
from tests.toy_project import ToyProject


def page(toy: ToyProject) -> str:
    toy.kendama("report", "-o", "page.html")
    return (toy.folder / "page.html").read_text()


def test_its_artifact_messages_chapter_and_headline_are_found_by_its_declaration(toy: ToyProject) -> None:
    document = toy.run_json()
    assert [stage["stage"] for stage in document["stages"]] == ["toy_roll", "toy_total"]
    body = json.loads((Path(document["stages"][0]["artifact"]) / "artifact.json").read_text())
    assert set(body) == {"values", "names", "die", "counts", "largest"}, "the file names no type"
    shown = page(toy)
    for seen in ("Rolled numbers", "Every number that was drawn.", "<b>20 numbers</b>", "is the sum of the numbers"):
        assert seen in shown
    toy.kendama("run", "-p", "toy", "seed=5")
    runs = [record["run"] for record in json.loads(toy.kendama("runs", "--json").stdout)]
    toy.kendama("report", *runs, "-o", "both.html")
    assert "Rolled numbers" in (toy.folder / "both.html").read_text()


def test_every_file_of_its_package_counts_and_a_chapter_is_drawn_as_it_is_now(toy: ToyProject) -> None:
    toy.run_json()
    chapter, messages = toy.folder / "lib/toy/roll/chapter.py", toy.folder / "lib/toy/roll/messages.py"
    chapter.write_text(chapter.read_text().replace("was drawn", "was thrown"))
    assert "Every number that was thrown." in page(toy)
    messages.write_text(messages.read_text() + "\nLIMIT = 3\n")
    plan = json.loads(toy.kendama("plan", "-p", "toy", "--json").stdout)
    assert plan["stages"][0]["reasons"] == ["code toy/roll/chapter.py changed", "code toy/roll/messages.py changed"]


def test_a_stage_that_gives_something_else_than_declared_fails_in_one_line(toy: ToyProject) -> None:
    document = toy.run_json("toy.gives_list=true", expect=1)
    assert document["stages"][0]["error"] == "stage 'roll' returned a list; its declaration says Rolls"


def test_a_stage_that_stopped_early_keeps_what_it_has_and_ends_with_an_error(toy: ToyProject) -> None:
    stage = toy.folder / "lib/toy/roll/stage.py"
    stage.write_text(stage.read_text().replace('"n": len(values)', '"completed": False, "n": len(values)'))
    for _ in range(2):
        made = toy.run_json(expect=1)
        assert made["outcome"] == "done"
        assert made["stages"][0]["metrics"]["n"] == 20
    assert made["stages"][0]["status"] == "cached"


def test_an_artifact_of_fields_that_cannot_be_stored_is_refused_before_the_stage_runs(toy: ToyProject) -> None:
    artifact = toy.folder / "lib/toy/roll/artifact.py"
    artifact.write_text(artifact.read_text().replace("names: tuple[str, ...]", "names: list[str]"))
    document = toy.run_json(f"toy.count_file={toy.folder}/count", expect=1)
    assert (
        "stage 'roll' declares that it returns toy.roll.artifact:Rolls, whose field 'names' is declared list[str]"
        in (document["stages"][0]["error"])
    )
    assert not (toy.folder / "count").exists()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "def figures(log):\n    raise KeyError('a field')\n",
            "cannot be drawn from this log (KeyError: &#x27;a field",
        ),
        ("import nowhere_to_be_found\n", "needs module &#x27;nowhere_to_be_found&#x27;, which is not installed"),
        ("", "has no &#x27;figures&#x27;"),
    ],
)
def test_where_a_chapter_cannot_be_drawn_the_page_says_so_and_continues(toy: ToyProject, text: str, says: str) -> None:
    toy.run_json()
    (toy.folder / "lib/toy/roll/chapter.py").write_text(text)
    shown = page(toy)
    assert says in shown
    assert 'id="total"' in shown


def test_a_run_of_a_stage_that_is_no_longer_installed_still_has_a_page(toy: ToyProject) -> None:
    toy.run_json()
    (toy.folder / "lib/toy-1.0.dist-info/entry_points.txt").write_text("")
    assert 'id="roll"' in page(toy)


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ("toy_roll = toy.numbers:SCALE", "it must name a StageDeclaration of name 'toy_roll'"),
        ("toy_roll = toy.nowhere:STAGE", "stage 'toy_roll' needs module 'toy.nowhere', which is not installed"),
        ("other = toy.roll:STAGE", "no stage 'toy_roll'; there are adapt, bench, capture, encode, fit, identify, "),
    ],
)
def test_a_wrong_entry_point_is_named_in_one_line(toy: ToyProject, entry: str, says: str) -> None:
    (toy.folder / "lib/toy-1.0.dist-info/entry_points.txt").write_text(f"[kendama.stages]\n{entry}\n")
    error = toy.kendama("plan", "-p", "toy", expect=2).stderr
    assert says in error
    assert error.count("\n") == 1


def test_a_broken_package_stops_only_those_who_use_it(toy_beside_ours: ToyProject) -> None:
    (toy_beside_ours.folder / "lib/toy-1.0.dist-info/entry_points.txt").write_text(
        "[kendama.stages]\ntoy_roll = toy.nowhere:S\n"
    )
    toy_beside_ours.kendama("plan", "-p", "imitation")
    assert "needs module 'toy.nowhere'" in toy_beside_ours.kendama("config", "+toy=default", expect=2).stderr


def test_doctor_lists_what_packages_declare_and_what_of_it_is_broken(toy: ToyProject) -> None:
    entries = toy.folder / "lib/toy-1.0.dist-info/entry_points.txt"
    entries.write_text(entries.read_text() + "lost = toy.nowhere:STAGE\n")
    stages_alone = "from kendama_cli.plugins.help import doctor; doctor.REQUIRED = doctor.EXTRAS = {}; "
    stages_alone += "doctor.groups = lambda: ['kendama.stages']"
    words = ("doctor", "--json")
    done = warm_command.kendama(words, toy.folder, toy.environment(), 240, before=stages_alone)
    assert done.returncode == 1, done.stderr
    parts = {part["name"]: part for part in json.loads(done.stdout)}
    assert (
        "learn, measure, offline, predict, rehearse, toy_roll, toy_total, transfer" in parts["kendama.stages"]["detail"]
    )
    assert parts["lost"]["state"] == "missing"
    assert "needs module 'toy.nowhere', which is not installed" in parts["lost"]["detail"]


@pytest.mark.slow  # imports everything
def test_a_part_that_asks_for_its_extra_is_optional(toy: ToyProject) -> None:
    (toy.folder / "lib/toy/roll/stage.py").write_text(
        "from kendama_cli.errors import MissingPartError\nraise MissingPartError('dice', 'dice: pip install dice')\n"
    )
    parts = json.loads(toy.kendama("doctor", "--json").stdout)
    assert {"name": "toy_roll", "state": "optional", "detail": "dice: pip install dice"} in parts


@pytest.mark.slow  # imports everything
def test_doctor_imports_what_it_lists(toy: ToyProject) -> None:
    (toy.folder / "lib/filelock.py").write_text("raise ImportError('built for another Python')\n")
    (toy.folder / "lib/cma.py").write_text(
        "import os, sys\nprint('Illegal', file=sys.stderr, flush=True)\nos._exit(3)\n"
    )
    (toy.folder / "lib/toy/roll/stage.py").write_text("1 / 0\n")
    found = subprocess.run(
        toy.command("doctor", "--json"),
        cwd=toy.folder,
        env=toy.environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    parts = {part["name"]: part for part in json.loads(found.stdout)}
    assert found.returncode == 1
    assert parts["filelock"]["detail"] == "ImportError: built for another Python; pip install filelock"
    assert parts["cma"]["detail"] == "Illegal; pip install cma"
    assert parts["toy_roll"]["detail"] == "ZeroDivisionError: division by zero"
    assert parts["numpy"]["state"] == "ok"
