"""Tests of real time run beside each other only, one per core: nothing of the suite's other processes computes then.

A test marked ``realtime`` waits until every other worker is between two tests or in such a test itself, and the others
wait for it in turn. These tests wait for peers and clocks for most of their time.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

POLL_S = 0.01


def forget() -> None:
    """Remove what the workers of this process left."""
    shutil.rmtree(_folder(os.getpid()), ignore_errors=True)


@contextlib.contextmanager
def turn(*, realtime: bool) -> Iterator[None]:
    """The time of one test of this worker, beside which others run only tests of the same kind."""
    own = os.environ.get("PYTEST_XDIST_WORKER")
    if own is None:  # no workers, nobody beside
        yield
        return
    locks = shared_folder()
    others = {f"gw{i}" for i in range(int(os.environ["PYTEST_XDIST_WORKER_COUNT"]))} - {own}
    with contextlib.ExitStack() as stack:
        with FileLock(locks / "next", poll_interval=POLL_S):  # whoever holds it begins next: nobody is overtaken
            while not _may_begin([_running(locks, one) for one in others], realtime=realtime):
                time.sleep(POLL_S)
            (locks / f"{own}.kind").write_text("realtime" if realtime else "other")
            stack.enter_context(FileLock(locks / own))
        yield


def _may_begin(beside: list[str | None], *, realtime: bool) -> bool:
    """Whether a test may begin beside others of these kinds; None stands for a worker between two tests."""
    if realtime:
        return "other" not in beside and beside.count("realtime") < (os.cpu_count() or 1)
    return "realtime" not in beside


def _running(locks: Path, worker: str) -> str | None:
    """The kind of the test that ``worker`` runs, None between two; its lock goes with its process, whatever happens."""
    try:
        with FileLock(locks / worker, blocking=False):
            return None
    except Timeout:
        return (locks / f"{worker}.kind").read_text()


def shared_folder() -> Path:
    """The folder of a worker's and the others' locks."""
    made = _folder(os.getppid())
    made.mkdir(exist_ok=True)
    return made


def _folder(process: int) -> Path:
    return Path(tempfile.gettempdir()) / f"kendama-tests-{process}"
