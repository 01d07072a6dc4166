"""Tests of real time run beside each other only: nothing of the suite's other processes computes then.

They stand last, in files of their own. A worker that comes to the first of them waits for the others to do so, or to
end; then as many run at once as there are cores.
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

POLL_S = 0.02
COMPUTING = "{}.computes"
"""The lock of a worker that has other tests ahead of it; it goes with its process, whatever happens."""
_held: list[FileLock] = []


def begin() -> None:
    """Hold those of real time in other workers back until this worker comes to its own, or ends."""
    _held.append(FileLock(shared_folder() / COMPUTING.format(os.environ["PYTEST_XDIST_WORKER"])))
    _held[0].acquire()


def forget() -> None:
    """Remove what the workers of this process left."""
    while _held:
        _held.pop().release()
    shutil.rmtree(_folder(os.getpid()), ignore_errors=True)


@contextlib.contextmanager
def turn() -> Iterator[None]:
    """The time of one test of real time; without workers there is nobody beside."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        yield
        return
    while _held:
        _held.pop().release()
    for number in range(int(os.environ["PYTEST_XDIST_WORKER_COUNT"])):
        with FileLock(shared_folder() / COMPUTING.format(f"gw{number}"), poll_interval=POLL_S):
            pass
    with _place():
        yield


@contextlib.contextmanager
def _place() -> Iterator[None]:
    """One of the places for tests that run at once."""
    while True:
        for number in range(os.cpu_count() or 1):
            with contextlib.suppress(Timeout), FileLock(shared_folder() / f"place{number}", blocking=False):
                yield
                return
        time.sleep(POLL_S)


def shared_folder() -> Path:
    """The folder of the workers' locks, and of what they share; without workers, of this process."""
    made = _folder(os.getppid() if "PYTEST_XDIST_WORKER" in os.environ else os.getpid())
    made.mkdir(exist_ok=True)
    return made


def _folder(process: int) -> Path:
    return Path(tempfile.gettempdir()) / f"kendama-tests-{process}"
