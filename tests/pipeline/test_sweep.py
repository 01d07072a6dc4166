"""Sweeps: one run for each distinct combination, shared stages once, failures apart, only what is missing."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from tests.portable import portable_is_slow
from tests.toy_project import ToyProject, artifact_bytes


def sweep(toy: ToyProject, *overrides: str, expect: int = 0) -> list[dict[str, Any]]:
    done = toy.kendama("sweep", "-p", "toy", "--json", *overrides, expect=expect)
    return list(json.loads(done.stdout)["runs"])


def test_lists_and_ranges_make_one_run_per_combination(toy: ToyProject) -> None:
    runs = sweep(toy, "seed=range(0,3)", "toy.steps=2,3")
    assert [run["overrides"] for run in runs] == [
        [f"seed={seed}", f"toy.steps={steps}"] for seed in (0, 1, 2) for steps in (2, 3)
    ]
    assert all(stage["status"] == "ran" for run in runs for stage in run["stages"])
    assert len({run["stages"][0]["metrics"]["sum"] for run in runs}) == 6


def test_choice_and_glob_work_and_equal_combinations_run_once(toy: ToyProject) -> None:
    (toy.folder / "conf/toy/other.yaml").write_text((toy.folder / "conf/toy/default.yaml").read_text())
    (toy.folder / "pipelines/toy.yaml").write_text(
        (toy.folder / "pipelines/toy.yaml").read_text().replace('["+toy=default"]', "[]")
    )
    done = toy.kendama("sweep", "-p", "toy", "--json", "+toy=glob(*)", "seed=choice(1,1,2)")
    assert len(json.loads(done.stdout)["runs"]) == 2, (
        "two groups of equal content, a seed given twice: two runs, not six"
    )
    assert "4 combinations, 2 different: no stage reads what the others change\n" in done.stderr


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_a_shared_stage_is_computed_once(toy: ToyProject) -> None:
    path = toy.folder / "pipelines/toy.yaml"
    shared = path.read_text().replace("needs: [roll], config: [toy]", "needs: [roll], config: {toy: lighting}")
    path.write_text(shared.replace('"+toy=default"', '"+toy=default", +lighting=dim'))
    count = toy.folder / "count"
    runs = sweep(toy, f"toy.count_file={count}", "lighting.ambient=0.3,0.4,0.5")
    assert count.read_text() == "x" * 20
    assert sorted(run["stages"][0]["status"] for run in runs) == ["cached", "cached", "ran"]
    assert [run["stages"][1]["status"] for run in runs] == ["ran"] * 3


@portable_is_slow
@pytest.mark.usefixtures("each_way")
def test_a_failed_job_stops_no_other_and_a_second_sweep_does_only_what_is_missing(toy: ToyProject) -> None:
    runs = sweep(toy, "toy.fail_at=3,-1", "seed=1", expect=1)
    assert [run["outcome"] for run in runs] == ["failed", "done"]
    assert "told to fail at 3" in runs[0]["stages"][0]["error"]
    again = sweep(toy, "toy.fail_at=3,-1", "seed=1,2", expect=1)
    assert [run["stages"][0]["status"] for run in again] == ["failed", "failed", "cached", "ran"]


def test_runs_that_share_a_fork_server_have_each_its_own_settings_and_seed(toy: ToyProject) -> None:
    runs = sweep(toy, "-j", "1", "toy.steps=3,4", "seed=1,2")
    assert [run["stages"][0]["metrics"]["n"] for run in runs] == [3, 3, 4, 4]
    assert len({run["stages"][0]["metrics"]["sum"] for run in runs}) == 4
    alone = toy.run_json("toy.steps=4", "seed=2", "--home", "other")
    assert artifact_bytes(runs[3]) == artifact_bytes(alone)


def test_a_request_for_very_many_files_reaches_the_workers_of_a_sweep(toy: ToyProject) -> None:
    settings = toy.folder / "lib/toy/roll/settings.py"
    settings.write_text(settings.read_text() + '    names: str = setting("as long as the names of 10 000 files")\n')
    conf = toy.folder / "conf/toy/default.yaml"
    conf.write_text(conf.read_text() + f"names: {'x' * 1_300_000}\n")
    runs = sweep(toy, "-j", "1", "seed=1,2")
    assert [stage["status"] for run in runs for stage in run["stages"]] == ["ran"] * 4


@pytest.mark.parametrize("command", ["run", "sweep"])
def test_a_worker_that_dies_while_it_imports_reports_its_last_line(toy: ToyProject, command: str) -> None:
    stage = toy.folder / "lib/toy/roll/stage.py"
    broken = "import sys\nprint('numpy.core.multiarray failed to import', file=sys.stderr)\nsys.stderr.flush()\n"
    stage.write_text(f"{broken}import os\nos._exit(3)\n")
    done = toy.kendama(command, "-p", "toy", expect=1)
    assert "numpy.core.multiarray failed to import" in done.stderr


def test_a_sweep_over_a_key_that_the_pipeline_does_not_read_is_one_run(toy_beside_ours: ToyProject) -> None:
    assert len(sweep(toy_beside_ours, "learn.alpha=0.1,0.2")) == 1


def test_a_wrong_value_is_reported_before_anything_runs(toy: ToyProject) -> None:
    done = toy.kendama("sweep", "-p", "toy", "toy.steps=2,0", expect=2)
    assert done.stderr == "kendama: 'toy.steps' is 0; allowed: at least 1\n"
    assert not (toy.home / "runs").exists()


@portable_is_slow
def test_kill_9_of_a_sweep_leaves_nothing_running_and_the_next_does_what_is_missing(
    toy: ToyProject, each_way: bool
) -> None:
    overrides = ("seed=range(0,4)", "toy.steps=20", "toy.pause_s=0.05")
    process = toy.start("sweep", "-p", "toy", "-j", "2", *overrides)
    deadline = time.monotonic() + 90
    while len(list(toy.home.glob("results/toy_total/*"))) + len(list(toy.home.glob("results/total/*"))) < 1:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    family = descendants(process.pid)
    assert len(family) >= (1 if each_way else 2), "two fork servers, or what interpreters compute now"
    process.kill()
    process.wait()
    while any(Path(f"/proc/{pid}").exists() and "Z" not in state(pid) for pid in family):
        assert time.monotonic() < deadline + 10, "an orphan"
        time.sleep(0.05)
    runs = sweep(toy, *overrides)
    assert [run["outcome"] for run in runs] == ["done"] * 4
    assert "cached" in {stage["status"] for run in runs for stage in run["stages"]}
    alone = [toy.run_json(f"seed={seed}", *overrides[1:], "--home", "other") for seed in range(4)]
    assert [artifact_bytes(run) for run in runs] == [artifact_bytes(run) for run in alone]


def test_a_killed_fork_server_fails_one_job_at_most_and_the_sweep_continues(toy: ToyProject) -> None:
    process = toy.start(
        "sweep", "-p", "toy", "-j", "1", "--json", "seed=range(0,4)", "toy.steps=10", "toy.pause_s=0.05"
    )
    deadline = time.monotonic() + 90
    while not list(toy.home.glob("results/total/*")):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    fork_servers = [
        pid for pid in descendants(process.pid) if b"forkserver" in Path(f"/proc/{pid}/cmdline").read_bytes()
    ]
    os.kill(fork_servers[0], signal.SIGKILL)
    outcomes = [run["outcome"] for run in json.loads(process.communicate(timeout=180)[0])["runs"]]
    assert outcomes.count("done") >= 3
    assert len(outcomes) == 4


def descendants(pid: int) -> list[int]:
    found: list[int] = []
    with contextlib.suppress(ProcessLookupError, FileNotFoundError):  # it has ended meanwhile
        for task in Path(f"/proc/{pid}/task").glob("*/children"):
            for child in map(int, task.read_text().split()):
                found += [child, *descendants(child)]
    return found


def state(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"
