"""Tests of real time run alone: nothing of the suite's other processes computes beside them.

A test marked ``realtime`` waits until every other worker is between two tests, and holds them there.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock

POLL_S = 0.01


def forget() -> None:
    """Remove what the workers of this process left."""
    shutil.rmtree(_folder(os.getpid()), ignore_errors=True)


@contextlib.contextmanager
def turn(*, alone: bool) -> Iterator[None]:
    """The time of one test of this worker; of no other worker's where it is to be ``alone``."""
    own = os.environ.get("PYTEST_XDIST_WORKER")
    if own is None:  # no workers, nobody beside
        yield
        return
    locks = shared_folder()
    held = [f"gw{i}" for i in range(int(os.environ["PYTEST_XDIST_WORKER_COUNT"]))] if alone else [own]
    with contextlib.ExitStack() as stack:
        with FileLock(locks / "next", poll_interval=POLL_S):  # so that who waits for all is not overtaken for ever
            for worker in held:
                stack.enter_context(FileLock(locks / worker, poll_interval=POLL_S))
        yield


def shared_folder() -> Path:
    """The folder of a worker's and the others' locks."""
    made = _folder(os.getppid())
    made.mkdir(exist_ok=True)
    return made


def _folder(process: int) -> Path:
    return Path(tempfile.gettempdir()) / f"kendama-tests-{process}"
