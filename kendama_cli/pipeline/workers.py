"""The worker processes of one run: started with a request, heard through a pipe each, ended together."""

from __future__ import annotations

import fcntl
import json
import os
import selectors
import signal
import subprocess
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from kendama_cli.pipeline.plan import StagePlan
from kendama_cli.pipeline.process import ForkServer, Interpreters, Worker
from kendama_cli.store import durable

GRACE_S = 10.0


@dataclass
class Job:
    """One stage that a worker computes; ``done`` and ``failed`` are the events by which it ended, None before."""

    plan: StagePlan
    process: Worker
    events: IO[bytes]
    lock: int
    started_s: float
    pending: bytes = b""
    done: dict[str, Any] | None = None
    failed: dict[str, Any] | None = None


class Workers:
    """The workers that run now; ``starter`` makes their processes."""

    def __init__(self, starter: Interpreters | ForkServer) -> None:
        self._starter = starter
        self._jobs: dict[str, Job] = {}
        self._selector = selectors.DefaultSelector()

    def __len__(self) -> int:
        """How many there are."""
        return len(self._jobs)

    def start(self, plan: StagePlan, request: Mapping[str, Any], lock: int, output: Path) -> None:
        """Have a worker carry out ``request``; it holds ``lock``, and what it prints goes to ``output``."""
        read, write = os.pipe()
        with durable.plain_disk_errors(output), output.open("wb") as printed:
            process = self._starter.start(request, events=write, lock=lock, printed=printed.fileno())
        os.close(write)
        events = os.fdopen(read, "rb", buffering=0)
        os.set_blocking(read, False)
        self._jobs[plan.spec.name] = Job(plan, process, events, lock, time.monotonic())
        self._selector.register(events, selectors.EVENT_READ, plan.spec.name)

    def events(self, timeout_s: float) -> Iterator[tuple[Job, dict[str, Any]]]:
        """What the workers report within ``timeout_s``; the last event of each is ``ended``, with its exit code."""
        for ready, _ in self._selector.select(timeout_s):
            job = self._jobs[ready.data]
            data = job.events.read()
            if data:
                *lines, job.pending = (job.pending + data).split(b"\n")
                yield from ((job, json.loads(line)) for line in lines)
            elif data == b"":
                yield job, {"event": "ended", "code": self._end(job)}

    def stop(self) -> None:
        """End every worker: asked first, and killed where it does not end in time."""
        for job in self._jobs.values():
            job.process.send_signal(signal.SIGTERM)
        deadline_s = time.monotonic() + GRACE_S
        for job in self._jobs.values():
            try:
                job.process.wait(max(0.0, deadline_s - time.monotonic()))
            except subprocess.TimeoutExpired:
                job.process.kill()
                job.process.wait()
            os.close(job.lock)
            job.events.close()

    def close(self) -> None:
        """Listen no more."""
        self._selector.close()

    def _end(self, job: Job) -> int:
        self._selector.unregister(job.events)
        job.events.close()
        code = job.process.wait()
        os.close(job.lock)
        del self._jobs[job.plan.spec.name]
        return code


def lock_file(path: Path) -> int | None:
    """A descriptor that holds the lock on ``path`` until it and its copies are closed; None where another has it."""
    with durable.plain_disk_errors(path):
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        return None
    return lock
