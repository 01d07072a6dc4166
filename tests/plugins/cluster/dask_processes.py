"""A Dask scheduler and workers on loopback, each a process of its own that a test may kill."""

from __future__ import annotations

import json
import subprocess
import sys
import time

from tests.toy_project import ToyProject

START_S = 90.0


class DaskProcesses:
    """A scheduler with workers that know the toy project; a context manager."""

    def __init__(self, toy: ToyProject, *, workers: int = 2, environment: dict[str, str] | None = None) -> None:
        self.environment = {**toy.environment(), "DASK_DISTRIBUTED__DIAGNOSTICS__NVML": "false", **(environment or {})}
        self.folder = toy.folder / "cluster"
        self.folder.mkdir(exist_ok=True)
        self._file = self.folder / "scheduler.json"
        self.scheduler: subprocess.Popen[bytes]
        self.workers: list[subprocess.Popen[bytes]] = []
        self._wanted = workers

    def __enter__(self) -> DaskProcesses:
        self.begin()
        return self

    def __exit__(self, *error: object) -> None:
        self.end()

    @property
    def address(self) -> str:
        return str(json.loads(self._file.read_text())["address"])

    def begin(self) -> None:
        """Begin a scheduler, and workers of it."""
        self._file.unlink(missing_ok=True)
        self.scheduler = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        deadline = time.monotonic() + START_S
        while not self._file.exists():
            assert time.monotonic() < deadline
            assert self.scheduler.poll() is None, (self.folder / "dask_scheduler.txt").read_text()
            time.sleep(0.05)
        for _ in range(self._wanted):
            self.add_worker()

    def add_worker(self) -> None:
        """Begin a further worker; it needs no nanny, for nobody else begins it anew."""
        options = ("--no-nanny", "--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard", "--local-directory")
        self.workers.append(self._start("dask_worker", *options, str(self.folder / "scratch")))

    def end(self) -> None:
        """Kill all of them."""
        for process in (self.scheduler, *self.workers):
            process.kill()
        for process in (self.scheduler, *self.workers):
            process.wait()
        self.workers.clear()

    def options(self, toy: ToyProject) -> list[str]:
        """What a command says to compute there."""
        (toy.folder / "shared").mkdir(exist_ok=True)
        place = toy.folder / "workers"
        where = (f"executor.scheduler={self.address}", "executor.connect_s=8", f"executor.workers_home={place}")
        return ["--on", "dask", *where, "store.remote=shared"]

    def _start(self, module: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{module}", "--scheduler-file", str(self._file), *options]
        with (self.folder / f"{module}.txt").open("ab") as printed:
            return subprocess.Popen(command, cwd=self.folder, env=self.environment, stdout=printed, stderr=printed)
