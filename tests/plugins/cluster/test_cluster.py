"""Stages on a Dask cluster: the bytes of this machine, each key once, and whatever dies, the same command goes on."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.plugins.cluster import task as cluster_task
from kendama_cli.plugins.cluster.shared import open_shared
from kendama_cli.plugins.cluster.task import placed_files
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.executor import ExecutorSettings
from kendama_cli.settings.store import StoreSettings
from kendama_cli.store.durable import file_sha256
from kendama_cli.store.store import Store
from tests.plugins.cluster.dask_processes import DaskProcesses
from tests.toy_project import ToyProject, artifact_bytes, statuses

distributed = pytest.importorskip("distributed")
cluster_module = pytest.importorskip("kendama_cli.plugins.cluster.dask_cluster")

SEEDS = "seed=range(0,6)"
SLOWLY = ("toy.steps=12", "toy.pause_s=0.03")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ToyProject, DaskProcesses]]:
    """A project with a cluster, for tests that kill nothing of it."""
    toy = ToyProject(tmp_path_factory.mktemp("cluster"), alone=True)
    with DaskProcesses(toy) as processes:
        yield toy, processes


def local(toy: ToyProject, *overrides: str) -> list[dict[str, Any]]:
    """The same sweep on this machine, in a home of its own."""
    done = toy.kendama("sweep", "-p", "toy", "--json", *overrides, "--home", "alone")
    return list(json.loads(done.stdout)["runs"])


def test_a_sweep_on_a_cluster_gives_the_bytes_of_this_machine_and_each_stage_once(
    cluster: tuple[ToyProject, DaskProcesses],
) -> None:
    toy, processes = cluster
    text = (toy.folder / "pipelines/toy.yaml").read_text()
    shared = text.replace("needs: [roll], config: [toy]", "needs: [roll], config: {toy: lighting}")
    (toy.folder / "pipelines/shared.yaml").write_text(shared.replace('"+toy=default"', '"+toy=default", +lighting=dim'))
    count = toy.folder / "count"
    over = ("lighting.ambient=0.3,0.4,0.5", f"toy.count_file={count}", "seed=1,2")
    on = processes.options(toy)
    runs = json.loads(toy.kendama("sweep", "-p", "shared", "--json", *on, *over).stdout)["runs"]
    assert count.read_text() == "x" * 40, "two rolls of twenty, for six runs"
    assert sorted(run["stages"][0]["status"] for run in runs) == ["cached"] * 4 + ["ran"] * 2
    assert list((toy.folder / "workers").iterdir()) != []
    alone = json.loads(toy.kendama("sweep", "-p", "shared", "--json", *over, "--home", "alone").stdout)["runs"]
    assert [artifact_bytes(run) for run in runs] == [artifact_bytes(run) for run in alone]
    assert [run["overrides"] for run in runs] == [run["overrides"] for run in alone], "where is no part of what"


def test_a_run_on_a_cluster_tells_progress_failures_and_what_was_printed(
    cluster: tuple[ToyProject, DaskProcesses],
) -> None:
    toy, processes = cluster
    on = processes.options(toy)
    done = toy.kendama("run", "-p", "toy", *on, "seed=50", "toy.steps=60", "toy.pause_s=0.1")
    assert "roll: starting" in done.stderr or "roll: starts (config" in done.stderr
    assert "/60, last " in done.stderr
    failed = toy.run_json(*on, "seed=51", "toy.fail_at=3", expect=1)
    assert failed["stages"][0]["error"] == "told to fail at 3"
    assert "told to fail at 3" in (toy.home / "runs" / failed["run"] / "roll.txt").read_text()
    again = toy.run_json(*on, "seed=50", "toy.steps=60", "toy.pause_s=0.1", "--force", "roll")
    assert statuses(again) == {"roll": "ran", "total": "cached"}


@pytest.mark.parametrize("longest", [0, 4096])
def test_an_answer_comes_whether_it_is_told_at_once_or_has_to_be_fetched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, longest: int
) -> None:
    """The one worker is a thread here, so that the limit holds for it; a request that is none is answered too."""
    monkeypatch.setattr(cluster_task, "OUTCOME_BYTES", longest)
    fetched: list[str] = []
    fetch = distributed.Future.result
    monkeypatch.setattr(distributed.Future, "result", lambda self, *given: fetched.append(self.key) or fetch(self))
    (tmp_path / "shared").mkdir()
    settings = StoreSettings(str(tmp_path / "shared"), None, 1.0)
    store = Store(tmp_path / "home", open_shared(settings, print))
    request = {"given": {}, "files": {}, "stage": "roll", "key": "1", "fresh": False, "parts": {"code": {"no.py": "1"}}}
    quiet = {"dashboard_address": ":0", "processes": False, "silence_logs": 60}
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, **quiet) as threads,
        distributed.Client(threads, set_as_default=False) as client,
        (tmp_path / "printed").open("wb") as printed,
    ):
        cluster = cluster_module.DaskCluster(client, store, settings, str(tmp_path / "workers"), 1)
        task = cluster.start(request, lock=None, printed=printed.fileno())
        told = [json.loads(line) for line in task.events]
        assert task.wait() == 1
    assert [event["event"] for event in told] == ["failed"]
    assert "has other code in no.py" in told[0]["message"]
    assert fetched == ([] if longest else ["roll-1"])


def test_a_stage_whose_process_dies_fails_alone(cluster: tuple[ToyProject, DaskProcesses]) -> None:
    toy, processes = cluster
    options = (*processes.options(toy), f"toy.kill_file={toy.folder / 'killed'}", "seed=60")
    first = toy.run_json(*options, expect=1)
    assert "ended by SIGKILL; the same command resumes from the last checkpoint" in first["stages"][0]["error"]
    assert statuses(toy.run_json(*options)) == {"roll": "ran", "total": "ran"}


def test_ctrl_c_ends_what_nobody_waits_for(cluster: tuple[ToyProject, DaskProcesses]) -> None:
    toy, processes = cluster

    def checkpoints() -> set[Path]:
        return set((toy.folder / "workers").glob("*/checkpoints/roll/*/*.ckpt"))

    before = checkpoints()
    process = toy.start("run", "-p", "toy", *processes.options(toy), "seed=70", "toy.steps=600", "toy.pause_s=0.1")
    wait_for(lambda: checkpoints() - before)
    process.send_signal(signal.SIGINT)
    told = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert (
        told.splitlines()[-1] == "kendama: interrupted; what was finished is kept, the same command goes on from there"
    )
    wait_for(lambda: not is_growing(checkpoints), 30.0)
    assert len(list((toy.folder / "shared").glob("results/roll/*"))) == len(list(toy.home.glob("results/roll/*")))


def is_growing(files: Callable[[], set[Path]]) -> bool:
    """Whether there are others a second later: a stage writes ten checkpoints in that time."""
    before = files()
    time.sleep(1.0)
    return files() != before


def test_files_that_a_worker_does_not_have_come_to_it(tmp_path: Path) -> None:
    (tmp_path / "there/images").mkdir(parents=True)
    (tmp_path / "shared").mkdir()
    table, image = tmp_path / "there/list.csv", tmp_path / "there/images/1.png"
    table.write_text("file\nimages/1.png\n")
    image.write_bytes(b"png")
    files = {str(path): {"sha256": file_sha256(path), "beside": str(table)} for path in (table, image)}
    shared = open_shared(StoreSettings(str(tmp_path / "shared"), None, 1.0), print)
    assert shared is not None
    store = Store(tmp_path / "home", shared)
    assert placed_files(files, store) == {}, "they are here"
    for path in (table, image):
        shared.share_file(path, files[str(path)]["sha256"])
        path.unlink()
    places = placed_files(files, store)
    assert Path(places[str(image)]) == Path(places[str(table)]).parent / "images/1.png"
    assert Path(places[str(image)]).read_bytes() == b"png"


def wait_for(condition: Any, seconds: float = 90.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_kill_9_of_driver_scheduler_and_worker_and_the_same_command_goes_on(toy: ToyProject) -> None:
    rng = random.Random(1)
    with DaskProcesses(toy) as processes:
        for whom in ("driver", "scheduler", "worker"):  # after a worker's death the sweep goes on by itself
            kill_during(toy, processes, whom, rng)
        runs = finished(toy, processes)
    alone = local(toy, SEEDS, *SLOWLY)
    assert [artifact_bytes(run) for run in runs] == [artifact_bytes(run) for run in alone]
    toy.kendama("cache", "verify")
    toy.kendama("cache", "verify", "--remote", "shared")


def kill_during(toy: ToyProject, processes: DaskProcesses, whom: str, rng: random.Random, seeds: str = SEEDS) -> None:
    """Begin the sweep, kill one of its processes once a result is there or a moment after, see the command end."""
    command = toy.command("sweep", "-p", "toy", *processes.options(toy), seeds, *SLOWLY)
    pipe = subprocess.PIPE
    driver = subprocess.Popen(command, cwd=toy.folder, env=toy.environment(), stdout=pipe, stderr=pipe, text=True)
    had = len(list((toy.folder / "shared").glob("results/*/*")))
    wait_for(lambda: len(list((toy.folder / "shared").glob("results/*/*"))) > had or driver.poll() is not None)
    time.sleep(rng.uniform(0.0, 0.3))
    if whom == "driver":
        driver.kill()
    elif whom == "scheduler":
        processes.scheduler.kill()
    else:
        rng.choice(processes.workers).kill()
    _, told = driver.communicate(timeout=120)
    assert "Traceback" not in told
    assert " - distributed." not in told, "Dask's own words"
    if whom == "scheduler":
        ends = ("then the same command goes on", "begin one with 'dask scheduler'")  # where it was not connected yet
        assert driver.returncode == 0 or any(line.endswith(ends) for line in told.splitlines())
        processes.end()
        processes.begin()
    elif whom == "worker":
        assert driver.returncode == 0
        processes.add_worker()


def finished(toy: ToyProject, processes: DaskProcesses, seeds: str = SEEDS) -> list[dict[str, Any]]:
    """What the same command says in the end."""
    done = toy.kendama("sweep", "-p", "toy", "--json", *processes.options(toy), seeds, *SLOWLY)
    return list(json.loads(done.stdout)["runs"])


def test_what_cannot_work_is_one_line(toy: ToyProject) -> None:
    def refused(*options: str) -> str:
        code = 1 if "executor.scheduler" in " ".join(options) and "tls_ca=c" not in " ".join(options) else 2
        done = toy.kendama("run", "-p", "toy", "--on", "dask", "store.remote=shared", *options, expect=code)
        assert done.stderr.count("\n") == 1, done.stderr
        return done.stderr

    (toy.folder / "shared").mkdir()
    told = toy.kendama("run", "-p", "toy", "--on", "dask", expect=2).stderr
    assert told.startswith("kendama: executor=dask needs a store through which machines exchange results: set")
    nobody = refused("executor.scheduler=tcp://127.0.0.1:9", "executor.connect_s=0.5")
    assert nobody.startswith("kendama: executor.scheduler=tcp://127.0.0.1:9: no Dask scheduler answers there (")
    files = [f"executor.{name}={toy.folder / 'wrong.pem'}" for name in ("tls_ca", "tls_cert", "tls_key")]
    missing = refused("executor.scheduler=tls://127.0.0.1:9", *files)
    assert missing == f"kendama: executor.tls_ca: no such file '{toy.folder / 'wrong.pem'}'\n"
    (toy.folder / "wrong.pem").write_text("not a certificate\n")
    wrong = refused("executor.scheduler=tls://127.0.0.1:9", *files)
    assert wrong.startswith("kendama: executor.tls_ca, tls_cert, tls_key: they are no certificates with their key (")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"scheduler": "host:8786"}, "'executor.scheduler' is 'host:8786'; allowed: tls://HOST:PORT, tcp://..."),
        ({"scheduler": "tls://h:1"}, "allowed: tls:// with tls_ca, tls_cert and tls_key, tcp:// without"),
        ({"tls_ca": "a.pem"}, "'executor.tls_cert' is null; allowed: a file, as 'tls_ca' is one"),
        ({"workers": 0}, "'executor.workers' is 0; allowed: at least 1"),
        ({"kind": "cosmos"}, "'executor.kind' is 'cosmos'; allowed: dask, local, slurm"),
    ],
)
def test_wrong_settings_are_refused(values: dict[str, Any], message: str) -> None:
    usual = {"scheduler": None, "tls_ca": None, "tls_cert": None, "tls_key": None, "workers": None}
    with pytest.raises(ConfigError) as caught:
        build_value(
            ExecutorSettings, {"kind": "dask", **usual, "workers_home": "~", "connect_s": 1.0, **values}, "executor"
        )
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("patch", "words"),
    [
        ("from kendama_cli import version; version.__version__ = '9.9'", "has kendama 9.9, here it is"),
        ("import platform; platform.python_version_tuple = lambda: ('3', '9', '1')", "has Python 3.9, here it is"),
    ],
)
def test_a_worker_of_another_kind_is_one_line(toy: ToyProject, patch: str, words: str) -> None:
    (toy.folder / "other").mkdir()
    (toy.folder / "other/sitecustomize.py").write_text(patch + "\n")
    path = os.pathsep.join([str(toy.folder / "other"), str(toy.folder / "lib")])
    with DaskProcesses(toy, workers=1, environment={"PYTHONPATH": path}) as processes:
        wait_for(lambda: "Starting established connection" in (processes.folder / "dask_worker.txt").read_text())
        done = toy.kendama("run", "-p", "toy", *processes.options(toy), expect=1)
    assert done.stderr.count("\n") == 1
    assert words in done.stderr
    assert done.stderr.endswith("install the same there\n")


def test_a_pipeline_that_reads_where_it_computes_is_refused(toy: ToyProject) -> None:
    path = toy.folder / "pipelines/toy.yaml"
    path.write_text(path.read_text().replace("config: [toy, seed]", "config: [toy, executor, seed]"))
    told = toy.kendama("plan", "-p", "toy", expect=2).stderr
    assert "stage 'roll' reads node 'executor', which says where the work is done" in told


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_fifty_kills_lose_nothing(toy: ToyProject) -> None:
    rng, count = random.Random(int(os.environ.get("SEED", "5"))), int(os.environ.get("KILLS", "50"))
    killed: dict[str, int] = {}
    with DaskProcesses(toy) as processes:
        for number in range(count):
            whom = ("driver", "scheduler", "worker")[number % 3]
            seeds = f"seed=range({100 * number},{100 * number + 6})"
            kill_during(toy, processes, whom, rng, seeds)
            killed[whom] = killed.get(whom, 0) + 1
            runs = finished(toy, processes, seeds)
            alone = local(toy, seeds, *SLOWLY)
            assert [artifact_bytes(run) for run in runs] == [artifact_bytes(run) for run in alone]
    print(killed)
