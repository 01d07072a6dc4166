"""kill -9 of any process of a run at any moment: the same command goes on to the same bytes, and nothing is left."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

from kendama_cli.store.home import run_names
from tests.toy_project import ToyProject, artifact_bytes, statuses

OPTIONS = ("toy.steps=12", "toy.pause_s=0.02")
ROUND = 8
"""So many kills before a run is let go on to its end."""


def processes(toy: ToyProject) -> list[int]:
    """Every process that has a file below the project's folder open, or works in it."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal() and int(entry.name) != os.getpid():
            try:
                if os.readlink(entry / "cwd") == str(toy.folder) and b"kendama" in (entry / "cmdline").read_bytes():
                    found.append(int(entry.name))
            except OSError:
                continue
    return found


def kill_one(toy: ToyProject, options: tuple[str, ...], rng: random.Random) -> str:
    """Start a run in a group of its own and kill some of it at a random moment; what was killed."""
    process = subprocess.Popen(
        toy.command("run", "-p", "toy", *options),
        cwd=toy.folder,
        env=toy.environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    whom = rng.choice(("group", "parent", "worker", "holder of the lock"))
    deadline = time.monotonic() + 20.0
    if whom in ("worker", "holder of the lock"):
        while process.poll() is None and len(processes(toy)) < 2 and time.monotonic() < deadline:
            time.sleep(0.01)
    time.sleep(rng.uniform(0.0, 1.2))
    try:
        if whom == "group":
            os.killpg(process.pid, signal.SIGKILL)
        elif whom == "parent":
            process.kill()
        else:
            others = [pid for pid in processes(toy) if pid != process.pid]
            for pid in others if whom == "worker" else holders(toy, others):
                os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait(timeout=120)
    return whom


def holders(toy: ToyProject, pids: list[int]) -> list[int]:
    """Those of ``pids`` that hold the lock of a stage."""
    found = []
    for pid in pids:
        try:
            links = [os.readlink(link) for link in Path(f"/proc/{pid}/fd").iterdir()]
        except OSError:
            continue
        if any("/locks/" in link and not link.endswith("home.lock") for link in links):
            found.append(pid)
    return found


def kill_many(toy: ToyProject, times: int, seed: int) -> dict[str, int]:
    """Kill ``times`` times in all; how often whom."""
    rng, whole = random.Random(seed), {}
    counted: dict[str, int] = {}
    for number in range(0, times, ROUND):
        count = toy.folder / f"count{number}"
        options = (*OPTIONS, f"seed={number}", f"toy.count_file={count}")
        for _ in range(min(ROUND, times - number)):
            whom = kill_one(toy, options, rng)
            counted[whom] = counted.get(whom, 0) + 1
        deadline = time.monotonic() + 30.0
        while processes(toy) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert processes(toy) == [], "a worker outlived its run"
        done = toy.run_json(*options)
        drawn = len(count.read_text())
        assert statuses(toy.run_json(*options)) == {"roll": "cached", "total": "cached"}
        assert len(count.read_text()) == drawn, "a stage that was committed was computed again"
        whole = artifact_bytes(toy.run_json(*options, "--home", "other"))
        assert artifact_bytes(done) == whole
        toy.kendama("cache", "verify")
        toy.kendama("cache", "gc", "--keep-runs", "1")
        left = {path.relative_to(toy.home).parts[0] for path in toy.home.rglob("*") if path.is_file()}
        assert left <= {"objects", "results", "runs", "index", "locks", "kendama-home.json"}, (
            "a kill left something that gc does not collect"
        )
        assert len(run_names(toy.home)) == 1
    return counted


@pytest.mark.slow
def test_some_kills_lose_nothing_and_leave_nothing(toy: ToyProject) -> None:
    assert sum(kill_many(toy, 4, seed=3).values()) == 4


@pytest.mark.slow
@pytest.mark.timeout(20_000)
def test_a_thousand_kills_lose_nothing_and_leave_nothing(toy: ToyProject) -> None:
    counted = kill_many(toy, int(os.environ.get("KILLS", "1000")), seed=4)
    print(counted)
    assert len(counted) == 4
