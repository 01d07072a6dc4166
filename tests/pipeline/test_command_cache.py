"""A run with nothing to do is recognised without planning it, and never where anything that it depends on changed."""

from __future__ import annotations

import importlib.metadata
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.pipeline.command_cache import SETTLED_S as SETTLED_S_AS_SHIPPED
from kendama_cli.pipeline.command_cache import stamp
from kendama_cli.pipeline.watched import looked_at
from kendama_cli.store import durable
from tests import warm_command
from tests.benchmarks import startup
from tests.toy_project import ToyProject

HEAVY = ("typer", "hydra", "omegaconf", "numpy", "pydantic", "rich", "yaml", "importlib.metadata", "pandas")
SETTLED_S = 0.3
"""Instead of the 2 s that also do for file systems which keep times to the second; these tests need 0.1."""
PROBE = f"""
import atexit
import os
import sys
from kendama_cli.cli import app
from kendama_cli.pipeline import command_cache
command_cache.SETTLED_S = float(os.environ.get("SETTLED_S", {SETTLED_S}))
way = ["quick"]
run_command = app.run_command

def in_full(*asked):
    way[0] = "full"
    return run_command(*asked)

app.run_command = in_full
atexit.register(lambda: print(way[0], file=sys.stderr))
"""


def run(
    toy: ToyProject, *arguments: str, folder: Path | None = None, **environment: str
) -> tuple[bool, dict[str, Any], list[str]]:
    """Whether the quick way was taken, the document, and what was printed on standard error."""
    words = ("run", "-p", "toy", "--json", *arguments)
    done = warm_command.kendama(words, folder or toy.folder, {**toy.environment(), **environment}, 120, before=PROBE)
    assert done.returncode == 0, done.stderr
    *printed, way = done.stderr.splitlines()
    return way == "quick", dict(json.loads(done.stdout)), printed


def statuses(document: dict[str, Any]) -> list[str]:
    return [stage["status"] for stage in document["stages"]]


def settle() -> None:
    time.sleep(SETTLED_S + 0.1)


@pytest.fixture
def idle(toy: ToyProject) -> ToyProject:
    """A toy project whose last run had nothing to do and was kept."""
    (toy.folder / "dice.csv").write_text("1,2\n")
    settle()
    run(toy)
    settle()
    run(toy)
    return toy


def replace(name: str, old: str, new: str) -> Callable[[ToyProject], None]:
    def change(toy: ToyProject) -> None:
        path = toy.folder / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    return change


def same_size_and_old_time(toy: ToyProject) -> None:
    path = toy.folder / "conf/toy/default.yaml"
    status = path.stat()
    path.write_text(path.read_text().replace("steps: 21", "steps: 22"))
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def another_package(toy: ToyProject) -> None:
    folder = toy.folder / "lib/other-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 1.0\n")


def shadow(toy: ToyProject) -> None:
    (toy.folder / "conf/store").mkdir(parents=True)
    (toy.folder / "conf/store/home.yaml").write_text("a: [broken\n")


CHANGES: list[tuple[str, Callable[[ToyProject], None], list[str]]] = [
    ("a value", replace("conf/toy/default.yaml", "steps: 20", "steps: 21"), ["ran", "ran"]),
    ("a value, with size and time as before", same_size_and_old_time, ["ran", "ran"]),
    ("code", replace("lib/toy/numbers.py", "1.0", "2.0"), ["ran", "ran"]),
    ("a comment", replace("lib/toy/numbers.py", "SCALE", "# words\nSCALE"), ["cached", "cached"]),
    ("the settings' schema", replace("lib/toy/roll/settings.py", "at_least=1", "at_least=2"), ["ran", "ran"]),
    ("the pipeline", replace("pipelines/toy.yaml", "config: [toy, seed]", "config: [seed, toy]"), ["cached", "cached"]),
    ("an installed package", another_package, ["cached", "cached"]),
]


def test_every_change_is_seen_and_leads_to_the_full_path_once(idle: ToyProject) -> None:
    for what, change, expected in CHANGES:
        quick, document, _ = run(idle)
        assert quick, f"before {what}"
        assert statuses(document) == ["cached", "cached"]
        change(idle)
        quick, document, _ = run(idle)
        assert not quick, what
        if what != "the settings' schema":  # whether that reruns is not this test's business
            assert statuses(document) == expected, what
        settle()
        run(idle)


def test_the_quick_path_prints_and_records_what_the_full_path_does(idle: ToyProject) -> None:
    quick, document, printed = run(idle)
    assert quick
    full, planned, printed_in_full = run(idle, "--until", "total")  # the same stages, asked in other words
    assert not full
    assert printed == printed_in_full
    in_order = [json.dumps({**one, "run": ""}) for one in (document, planned)]
    assert in_order[0] == in_order[1], "not even the order differs"
    records = json.loads(idle.kendama("runs", "--json").stdout)
    (one,) = [record for record in records if record["run"] == document["run"]]
    (other,) = [record for record in records if record["run"] == planned["run"]]
    assert one["outcome"] == "done"
    for fact in ("stages", "versions", "host", "pipeline", "overrides"):
        assert one[fact] == other[fact], fact
    text = idle.kendama("run", "-p", "toy").stdout.splitlines()
    assert text[0].startswith("roll      cached sum 1.301, n 20, ")  # the headline first
    assert text[-1].endswith(f"kendama report {text[-1].split()[1]}")


def test_a_plan_afterwards_compares_with_the_quick_run(idle: ToyProject) -> None:
    run(idle, "toy.steps=5")
    assert run(idle)[0]
    plan = json.loads(idle.kendama("plan", "-p", "toy", "toy.steps=6", "--json").stdout)
    assert plan["stages"][0]["reasons"] == ["config toy.steps 20 -> 6"]


@pytest.mark.parametrize("change", ["flip", "delete", "result"])
def test_a_damaged_or_missing_artifact_is_never_served(idle: ToyProject, change: str) -> None:
    quick, document, _ = run(idle)
    assert quick
    stage = document["stages"][0]
    file = Path(stage["artifact"]) / "arrays.npz"
    if change == "flip":
        status, data = file.stat(), bytearray(file.read_bytes())
        data[len(data) // 2] ^= 1
        file.write_bytes(data)
        os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))
    elif change == "delete":
        file.unlink()
    else:
        (idle.home / "results/roll" / f"{stage['key']}.json").unlink()
    quick, document, _ = run(idle)
    assert not quick
    assert statuses(document)[0] == "ran"


@pytest.mark.slow
def test_another_folder_variable_or_option_is_another_question(idle: ToyProject, tmp_path: Path) -> None:
    assert run(idle)[0]
    assert not run(idle, KENDAMA_HOME="elsewhere")[0]
    assert not run(idle, "seed=0")[0]
    assert not run(idle, "--force", "roll")[0]
    deeper = idle.folder / "deeper"
    (deeper / "conf").mkdir(parents=True)
    (deeper / "pipelines").symlink_to(idle.folder / "pipelines")
    (deeper / "conf/toy").symlink_to(idle.folder / "conf/toy")
    assert not run(idle, "--home", str(idle.home), folder=deeper)[0]
    shadow(idle)
    wrong = idle.kendama("run", "-p", "toy", expect=2)
    assert "home.yaml" in wrong.stderr, "a file that comes before the bundled one was not looked at"


@pytest.mark.slow
def test_a_forced_run_is_forced_every_time_and_one_that_asks_the_environment_gets_its_own_answers(
    idle: ToyProject,
) -> None:
    replace("conf/toy/default.yaml", "steps: 20", "steps: ${oc.decode:${oc.env:STEPS}}")(idle)
    # the second: whether conf/ has settled when the first looks at it, is the machine's affair
    for steps, expected in (("3", False), ("3", None), ("3", True), ("4", False), ("4", True), ("3", False)):
        quick, document, _ = run(idle, STEPS=steps)
        assert expected is None or quick is expected
        assert document["stages"][0]["metrics"]["n"] == int(steps)
        settle()
    replace("conf/toy/default.yaml", "${oc.decode:${oc.env:STEPS}}", "20")(idle)
    for _ in range(2):
        quick, document, _ = run(idle, "--force", "roll")
        assert not quick
        assert statuses(document)[0] == "ran"
        settle()


def test_a_file_that_was_changed_just_now_is_not_relied_on(idle: ToyProject) -> None:
    (idle.folder / "conf/toy/default.yaml").touch()
    assert not run(idle, SETTLED_S="100")[0]
    assert not run(idle)[0], "it was kept although the file could change again within one tick of its stamp"


@pytest.mark.parametrize("pattern", ["data/*.csv", "data/one.csv", "da?a/deep/*/x.csv", "absent/*.csv", "./data/*.csv"])
@pytest.mark.parametrize("new", ["data/two.csv", "data/deep/b/x.csv", "absent/a.csv", "data/one.csv"])
def test_a_new_file_that_a_pattern_means_changes_a_place_that_is_looked_at(
    tmp_path: Path, pattern: str, new: str
) -> None:
    roots = [tmp_path / "first", tmp_path / "second"]
    (roots[1] / "data/deep/a").mkdir(parents=True)
    (roots[1] / "data/one.csv").write_text("1")
    (roots[1] / "data/deep/a/x.csv").write_text("1")

    def meant() -> list[str]:
        return sorted(str(path) for root in roots for path in root.glob(pattern))

    def state() -> dict[str, list[int]]:
        return {str(path): stamp(path) for path in looked_at(pattern, roots)}

    for root in roots:
        before, found = state(), meant()
        (root / new).parent.mkdir(parents=True, exist_ok=True)
        (root / new).write_text("2")
        if meant() != found:
            assert state() != before, root


def modules(toy: ToyProject, *arguments: str) -> set[str]:
    """What ``kendama ARGUMENTS`` imports beyond a bare interpreter."""
    code = (
        "import sys; bare = set(sys.modules); from kendama_cli.cli.main import main; code = main(sys.argv[1:]);"
        "print(*sorted(set(sys.modules) - bare), file=sys.stderr); sys.exit(code)"
    )
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(
        command, cwd=toy.folder, env=toy.environment(), capture_output=True, text=True, timeout=120, check=True
    )
    return set(done.stderr.splitlines()[-1].split())


def test_a_run_with_nothing_to_do_imports_no_more_than_the_store_needs(idle: ToyProject) -> None:
    run_again = ("run", "-p", "toy", "--json")
    time.sleep(SETTLED_S_AS_SHIPPED - SETTLED_S)
    assert modules(idle, *run_again) >= {"typer"}, "another interpreter has another key"
    found = modules(idle, *run_again)
    assert not found & {*HEAVY}
    # what it costs is what it imports: 91 modules here, 5 to 7 bare interpreters by ``tests.benchmarks.startup``; with
    # the command line parsed and the run planned there are 400
    assert len(found) <= 100


PARSER = {"typer", "pydantic", "importlib.metadata"}
"""typer, and what it brings where it reads the options of one command."""


@pytest.mark.parametrize(
    ("arguments", "heavy"),
    [(["--help"], {"typer"}), (["robot", "place", "--help"], PARSER)],
)
def test_help_imports_the_parser_and_nothing_that_does_the_work(
    toy: ToyProject, arguments: list[str], heavy: set[str]
) -> None:
    found = modules(toy, *arguments)
    assert found & {*HEAVY} == heavy
    # of ours the commands' declarations, those of parts too, where things are and how files are written, and errors
    beside = {name for name in found if name.startswith("kendama_cli.") and not name.startswith("kendama_cli.cli")}
    light = {"config", "config.site", "errors", "schema", "schema.json_text", "store", "store.durable"}
    light |= {"schema.parts", "schema.registry", "system", "system.choice", "system.group", "system.interface"}
    parts = {name for name in beside if re.fullmatch(r"kendama_cli\.plugins(\.\w+){0,2}(\.commands)?", name)}
    assert beside - parts <= {f"kendama_cli.{name}" for name in light}


@pytest.mark.slow
def test_the_startup_benchmark_measures_each_command_to_its_end(tmp_path: Path) -> None:
    assert startup.measured(str(tmp_path), rounds=1).keys() == startup.COMMANDS.keys()


def test_a_run_says_in_one_line_where_a_cached_result_was_made_with_others(idle: ToyProject) -> None:
    for path in sorted(idle.home.glob("results/*/*.json")):
        record = durable.read_sealed(path)
        assert record is not None
        here = record["made_with"]["processor"].split()
        record["made_with"] |= {"processor": " ".join(["avx9", *here[1:]])}
        if path.parent.name == "roll":
            record["made_with"]["numpy"] = "0.1"
        durable.write_sealed(path, record)
    gone, numpy = f"a processor with avx9, here {here[0]}", importlib.metadata.version("numpy")
    told = f"cached results were made elsewhere: roll with numpy 0.1, here {numpy}; {gone}; total with {gone}"
    assert told in idle.kendama("run", "-p", "toy").stderr.splitlines(), "the quick way"
    replace("lib/toy/numbers.py", "SCALE", "# words\nSCALE")(idle)
    assert told in idle.kendama("run", "-p", "toy").stderr.splitlines(), "the full way"
