"""Processes that compute side by side, and end with the one that began them."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import wait
from typing import Any

PROCESSES = "KENDAMA_PROCESSES"
"""The environment variable that says how many processes one stage or film may take; every core where it is not set."""
MAX_PROCESSES = 8


def processes() -> int:
    """Return how many processes are worth beginning here."""
    asked = os.environ.get(PROCESSES, "")
    if asked.isdecimal() and int(asked) > 0:
        return int(asked)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, MAX_PROCESSES)


@contextlib.contextmanager
def cores_shared_by(jobs: int) -> Iterator[None]:
    """Give work that is started meanwhile its part of the cores, unless the user has said how many."""
    if PROCESSES in os.environ:
        yield
        return
    os.environ[PROCESSES] = str(max(1, processes() // max(1, jobs)))
    try:
        yield
    finally:
        del os.environ[PROCESSES]


@contextlib.contextmanager
def process_pool(begin: Callable[..., None], *given: Any) -> Iterator[ProcessPoolExecutor]:
    """Open ``processes()`` processes, each begun by ``begin(*given)``; what still waits at the end is not computed.

    They are interpreters of their own (threads and locks are not forked), and leave Ctrl-C to this process.
    """
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(processes(), context, _begin, (begin, given))
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(begin: Callable[..., None], given: tuple[Any, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    begin(*given)


def _end_with_parent() -> None:
    """End this process with its parent: it holds both ends of its queue, and would wait for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
