"""Stages in jobs of Slurm: what needs no Slurm with stand-ins for its commands; the rest on one that runs here."""

from __future__ import annotations

import json
import os
import random
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kendama_cli.errors import ClusterError, ConfigError
from kendama_cli.plugins.cluster.settings import SlurmExecutor
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.executor import ExecutorSettings
from tests.plugins.cluster.slurm_processes import SlurmProcesses, why_no_slurm
from tests.toy_project import ToyProject, artifact_bytes

pytest.importorskip("dask_jobqueue")

from kendama_cli.plugins.cluster import slurm

VALUES: dict[str, Any] = {
    "kind": "slurm",
    "partition": None,
    "account": None,
    "time": "01:00:00",
    "memory": "500MB",
    "cores": 1,
    "jobs": 2,
    "interface": "lo",
    "options": [],
    "workers_home": "~",
    "connect_s": 10.0,
}


def executor(**values: Any) -> SlurmExecutor:
    built = build_value(ExecutorSettings, {**VALUES, **values}, "executor")
    assert isinstance(built, SlurmExecutor)
    return built


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"time": "an hour"}, "'executor.time' is 'an hour'; allowed: as sbatch has it, 01:30:00 or 2-00:00:00"),
        ({"memory": "4"}, "'executor.memory' is '4'; allowed: a size such as 4GiB"),
        ({"options": ["rm -rf"]}, "'executor.options' holds 'rm -rf'; allowed: options of sbatch, such as --qos=long"),
        ({"options": ["--a\nrm"]}, "'executor.options' holds '--a\\nrm'; allowed: options of sbatch"),
        ({"partition": "a\nrm"}, "'executor.partition' is 'a\\nrm'; allowed: a name"),
        ({"account": "a b"}, "'executor.account' is 'a b'; allowed: a name"),
        ({"interface": "lo; rm"}, "'executor.interface' is 'lo; rm'; allowed: a name"),
        ({"jobs": 0}, "'executor.jobs' is 0; allowed: at least 1"),
    ],
)
def test_wrong_settings_are_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        executor(**values)
    assert message in str(caught.value)


@pytest.fixture
def commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder first in PATH, for commands that stand in for Slurm's."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    return folder


def stand_in(folder: Path, name: str, script: str) -> None:
    path = folder / name
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)


def test_without_slurm_or_in_a_home_that_no_script_can_name_it_is_one_line(
    tmp_path: Path, commands: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(commands, "sbatch", "exit 0")
    with pytest.raises(ClusterError, match=r"cannot stand in a job's script; choose another folder with --home"):
        slurm.slurm_jobs(executor(), tmp_path / "two words").__enter__()
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(ClusterError, match="this machine has no 'sbatch'; begin on a login node of the cluster"):
        slurm.slurm_jobs(executor(), tmp_path).__enter__()


def test_what_slurm_refuses_is_told_and_nothing_is_left(tmp_path: Path, commands: Path) -> None:
    stand_in(commands, "sbatch", f'cp "$2" {tmp_path}/script; echo "sbatch: error: invalid partition" >&2; exit 1')
    with pytest.raises(ClusterError, match=r"Slurm takes no such jobs \(invalid partition\); see executor.partition"):
        slurm.slurm_jobs(executor(partition="gpu", options=["--qos=long"]), tmp_path / "home").__enter__()
    script = (tmp_path / "script").read_text()
    assert "#SBATCH -p gpu" in script
    assert "#SBATCH --qos=long" in script
    assert "--no-dashboard" in script
    assert "--tls-key" in script
    assert list((tmp_path / "home/slurm").iterdir()) == []


class Jobs:
    """Stands in for the cluster: jobs by name, and those of them that reached this machine."""

    def __init__(self, folder: Path) -> None:
        self.security = SimpleNamespace(tls_ca_file=str(folder / "ca_file.pem"))
        self.workers = {"one": SimpleNamespace(job_id="1"), "two": SimpleNamespace(job_id="2")}
        self.scheduler_info: dict[str, Any] = {"workers": {}}
        self.replaced: list[str] = []

    def sync(self, scale_down: Callable[[list[str]], None], names: list[str]) -> None:
        scale_down(names)

    def scale_down(self, names: list[str]) -> None:
        """As dask-jobqueue does, which asks for others in their place then."""
        self.replaced += names
        for name in names:
            number = str(max(int(job.job_id) for job in self.workers.values()) + 1)
            del self.workers[name]
            self.workers[f"job {number}"] = SimpleNamespace(job_id=number)


def test_jobs_that_end_without_a_word_are_replaced_and_then_given_up_with_what_they_printed(
    tmp_path: Path, commands: Path
) -> None:
    stand_in(commands, "squeue", "echo '9|RUNNING|None'")
    jobs, told, ends = Jobs(tmp_path), list[str](), list[str]()
    watch = slurm.Watch(jobs, executor(connect_s=100.0), told.append, ends.append)
    for number in range(1, 9):
        (tmp_path / f"kendama-{number}.err").write_text(f"ImportError: {number}\nslurmstepd: bye\n")
    looks = 0
    while watch.goes_on():
        looks += 1
        assert looks < 20
    assert sorted(jobs.replaced) == ["one", "two"]
    assert ends == ["4 jobs of Slurm ended before they computed; the last one printed: ImportError: 4"]
    assert told == []


def test_jobs_that_reached_this_machine_are_never_given_up(tmp_path: Path, commands: Path) -> None:
    stand_in(commands, "squeue", "exit 0")
    jobs, ends = Jobs(tmp_path), list[str]()
    jobs.scheduler_info["workers"] = {"tls://a": {"name": "one"}, "tls://b": {"name": "two"}}
    watch = slurm.Watch(jobs, executor(), print, ends.append)
    assert all(watch.goes_on() for _ in range(8))
    assert (ends, jobs.replaced) == ([], [])


def test_where_slurm_lets_jobs_wait_its_reason_is_told_once(tmp_path: Path, commands: Path) -> None:
    stand_in(commands, "squeue", "echo '1|PENDING|Resources'; echo '2|PENDING|Priority'")
    told = list[str]()
    watch = slurm.Watch(Jobs(tmp_path), executor(connect_s=0.001), told.append, print)
    time.sleep(0.01)
    assert all(watch.goes_on() for _ in range(3))
    assert told == [
        "after 0.001 s none of 2 jobs has begun (1 PENDING: Resources, 2 PENDING: Priority); stages wait on"
    ]


def test_slurm_that_does_not_answer_now_changes_nothing(tmp_path: Path, commands: Path) -> None:
    stand_in(commands, "squeue", "echo 'Unable to contact slurm controller' >&2; exit 1")
    jobs = Jobs(tmp_path)
    watch = slurm.Watch(jobs, executor(connect_s=0.001), print, pytest.fail)
    assert all(watch.goes_on() for _ in range(8))
    assert jobs.replaced == []


@pytest.fixture(scope="module")
def real(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ToyProject, SlurmProcesses]]:
    """A Slurm of one node that this machine is, with a project."""
    reason = why_no_slurm()
    if reason:
        pytest.skip(reason)
    toy = ToyProject(tmp_path_factory.mktemp("slurm"))
    with SlurmProcesses(tmp_path_factory.mktemp("state")) as processes:
        yield toy, processes


SLOWLY = ("toy.steps=20", "toy.pause_s=0.05")


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_sweep_in_slurm_goes_on_whatever_dies_to_the_bytes_of_this_machine(
    real: tuple[ToyProject, SlurmProcesses],
) -> None:
    toy, processes = real
    rng = random.Random(3)
    for number, whom in enumerate(("nobody", "job", "daemon", "driver")):
        seeds = f"seed=range({100 * number},{100 * number + 8})"
        driver = processes.start(toy, seeds, *SLOWLY)
        before = len(list(toy.home.glob("results/*/*")))
        wait_for(lambda before=before: len(list(toy.home.glob("results/*/*"))) > before)  # type: ignore[misc]
        if whom == "job":
            processes.slurm("scancel", rng.choice(processes.jobs()))
        elif whom == "daemon":
            processes.kill_node_daemon()
            processes.begin_node_daemon()
        elif whom == "driver":
            driver.send_signal(signal.SIGKILL)
        told = driver.communicate(timeout=300)[1]
        assert "Traceback" not in told
        assert driver.returncode == (-signal.SIGKILL if whom == "driver" else 0), told
        wait_for(lambda: processes.jobs() == [])
        again = processes.start(toy, seeds, *SLOWLY)
        runs = json.loads(again.communicate(timeout=300)[0])["runs"]
        if whom != "driver":
            assert {stage["status"] for run in runs for stage in run["stages"]} == {"cached"}
        alone = toy.kendama("sweep", "-p", "toy", "--json", "--home", "alone", seeds, *SLOWLY)
        assert [artifact_bytes(run) for run in runs] == [
            artifact_bytes(run) for run in json.loads(alone.stdout)["runs"]
        ]
    toy.kendama("cache", "gc")
    assert list((toy.home / "slurm").iterdir()) == [], "certificates of the driver that was killed"
    toy.kendama("cache", "verify")


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_what_slurm_refuses_and_jobs_that_cannot_begin_end_a_sweep(real: tuple[ToyProject, SlurmProcesses]) -> None:
    toy, processes = real
    refused = processes.start(toy, "seed=900", "executor.partition=nosuch")
    told = refused.communicate(timeout=120)[1]
    assert refused.returncode == 1
    assert told.startswith("kendama: executor=slurm: Slurm takes no such jobs (invalid partition specified: nosuch")
    assert told.count("\n") == 1
    futile = processes.start(toy, "seed=900", 'executor.options=["--export=ALL,PYTHONHOME=/nonexistent"]')
    told = futile.communicate(timeout=200)[1]
    assert futile.returncode == 1
    assert "jobs of Slurm ended before they computed; the last one printed: " in told
    assert "ModuleNotFoundError: No module named 'encodings'" in told


def wait_for(condition: Callable[[], Any], seconds: float = 120.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)
