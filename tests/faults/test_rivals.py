"""Many processes on one home at once: runs, sweeps, collections and readers do each other no harm."""

from __future__ import annotations

import json
import os
import subprocess
import threading

import pytest

from kendama_cli.store.garbage import verify
from kendama_cli.store.home import run_names
from kendama_cli.store.store import Store
from tests.toy_project import ToyProject, artifact_bytes

UNWANTED = ("Traceback", "unexpected")


def ended(toy: ToyProject, process: subprocess.Popen[str], allowed: tuple[str, ...] = ()) -> str:
    """What ``process`` printed; it ended well, or in one line that says one of ``allowed``."""
    out, err = process.communicate(timeout=600)
    assert not [words for words in UNWANTED if words in err], err
    assert process.returncode == 0 or any(words in err for words in allowed), err
    return out


def collide(toy: ToyProject, number: int) -> None:
    """Two sweeps, two runs, two collections and two readers at once; then all is there, each number drawn once."""
    count = toy.folder / f"count{number}"
    options = ("-p", "toy", "toy.steps=3", f"toy.count_file={count}")
    first, others = 10 * number, f"seed={10 * number},{10 * number + 1},{10 * number + 2}"
    sweeps = [toy.start("sweep", *options, others, "--json") for _ in range(2)]
    runs = [toy.start("run", *options, f"seed={first + i}", "--json") for i in (0, 3)]
    beside = [toy.start(*words) for words in (("cache", "gc"), ("cache", "gc"), ("cache", "verify"), ("runs",))]
    made = [json.loads(ended(toy, process)) for process in runs]
    swept = [json.loads(ended(toy, process))["runs"] for process in sweeps]
    for process in beside:
        ended(toy, process, ("a run is using",))
    assert [one["outcome"] for run in swept for one in run] == ["done"] * 6
    assert count.read_text() == "x" * 3 * 4, "a stage that two wanted was computed twice"
    assert len({json.dumps(sorted(map(repr, artifact_bytes(one).items()))) for one in (made[0], swept[0][0])}) == 1
    assert verify(Store(toy.home)) == []


def test_eight_processes_on_one_home_do_each_other_no_harm(toy: ToyProject) -> None:
    collide(toy, 1)


@pytest.mark.slow
@pytest.mark.timeout(20_000)
def test_eight_processes_on_one_home_do_each_other_no_harm_a_hundred_times(toy: ToyProject) -> None:
    for number in range(int(os.environ.get("ROUNDS", "100"))):
        collide(toy, number)


def race(toy: ToyProject, runs: int) -> int:
    """Collect garbage for as long as a sweep of ``runs`` goes on; how often it could."""
    sweep = toy.start("sweep", "-p", "toy", "toy.steps=1", f"seed=range(0,{runs})", "--json")
    collected, stop = 0, threading.Event()

    def collect() -> None:
        nonlocal collected
        while not stop.is_set():
            done = subprocess.run(
                toy.command("cache", "gc"),
                cwd=toy.folder,
                env=toy.environment(),
                capture_output=True,
                text=True,
                check=False,
            )
            assert done.returncode == 0 or "a run is using" in done.stderr, done.stderr
            collected += done.returncode == 0

    beside = threading.Thread(target=collect)
    beside.start()
    records = json.loads(ended(toy, sweep))["runs"]
    stop.set()
    beside.join()
    assert [record["outcome"] for record in records] == ["done"] * runs
    store = Store(toy.home)
    assert verify(store) == []
    for record in records:
        for stage in record["stages"]:
            assert store.find(stage["name"], stage["key"]) is not None, "a collection took what a run had made"
    assert len(run_names(toy.home)) == runs
    return collected


@pytest.mark.slow
def test_collections_that_race_runs_lose_nothing(toy: ToyProject) -> None:
    race(toy, 8)


@pytest.mark.slow
@pytest.mark.timeout(20_000)
def test_collections_that_race_500_runs_lose_nothing(toy: ToyProject) -> None:
    assert race(toy, 500) >= 1
