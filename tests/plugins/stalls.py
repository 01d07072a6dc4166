"""Stalls of this machine: a test at a peer's own pace is tried again then, or left out."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import pytest

T = TypeVar("T")
STALL_S = 0.02
_STEP_S = 0.005
ATTEMPTS = 5


class Stalls:
    """The longest time that a thread, which only sleeps, was kept from going on [s]."""

    longest_s = 0.0


@contextmanager
def watched() -> Iterator[Stalls]:
    """Watches for stalls from here to the end of the block."""
    seen, over = Stalls(), threading.Event()

    def watch() -> None:
        last_s = time.monotonic()
        while not over.wait(_STEP_S):
            now_s = time.monotonic()
            seen.longest_s = max(seen.longest_s, now_s - last_s - _STEP_S)
            last_s = now_s

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield seen
    finally:
        over.set()
        thread.join()


def without_stall(work: Callable[[int], T], *excused: type[Exception], late: str | None = None) -> T:
    """What ``work``, given the number of the attempt, returns where the machine let it.

    An ``excused`` exception counts where there was no stall; with one it is tried again, and skipped in the end. One
    that says ``late`` may come of a stall of the peer's process, which is not seen from here: it counts when it comes
    in every attempt.
    """
    for attempt in range(ATTEMPTS):
        with watched() as stalls:
            try:
                return work(attempt)
            except excused as error:
                may_be_late = late is not None and late in str(error) and attempt < ATTEMPTS - 1
                if stalls.longest_s <= STALL_S and not may_be_late:
                    raise
    pytest.skip(f"this machine stood still in each of {ATTEMPTS} attempts, the last time for {stalls.longest_s:.3f} s")
