"""The worker processes of one run, started with a request, read through a pipe each, and their outcomes."""

from __future__ import annotations

import json
import queue
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.pipeline.plan import StagePlan
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.store import durable
from kendama_cli.system.interface import Lock, Starter, Worker, share_with_group

GRACE_S = 10.0
Ask = Callable[[str], str | None]
"""Puts a question to the person at the terminal and returns the answer, None at the end of input."""


@dataclass
class Job:
    """One stage that a worker computes; ``done`` and ``failed`` are the events by which it ended, None before."""

    plan: StagePlan
    process: Worker
    lock: Lock
    started_s: float
    done: dict[str, Any] | None = None
    failed: dict[str, Any] | None = None


class Workers:
    """The workers that run now."""

    def __init__(self, ask: Ask | None = None) -> None:
        """Take what answers the workers' questions, None where nobody does."""
        self._ask = ask
        self._jobs: dict[str, Job] = {}
        # a thread reads each pipe: not every system can wait for several pipes at once
        self._lines: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()

    def __len__(self) -> int:
        """Return the number of workers."""
        return len(self._jobs)

    @property
    def attended(self) -> bool:
        """True if somebody answers questions."""
        return self._ask is not None

    def start(self, starter: Starter, plan: StagePlan, request: Mapping[str, Any], *, lock: Lock, output: Path) -> None:
        """Start a worker of ``starter`` that runs ``request``, holding ``lock``; its printed output goes to
        ``output``.
        """
        with durable.plain_disk_errors(output), output.open("wb") as printed:
            share_with_group(output)
            process = starter.start(request, lock=lock, printed=printed.fileno())
        name = plan.spec.name
        self._jobs[name] = Job(plan, process, lock, time.monotonic())
        threading.Thread(target=_read, args=(name, process, self._lines), daemon=True).start()

    def events(self, timeout_s: float) -> Iterator[tuple[Job, dict[str, Any]]]:
        """Yield what the workers report within ``timeout_s``; the last event of each is ``ended``, with its exit
        code.
        """
        try:
            name, line = self._lines.get(timeout=timeout_s)
            while True:
                job = self._jobs[name]
                event: dict[str, Any] = json.loads(line) if line else {"event": "ended", "code": self._end(job)}
                if event["event"] == "asks" and self._ask is not None:
                    durable.write_file(Path(event["answer"]), json.dumps(self._ask(event["question"])).encode())
                else:
                    yield job, event
                name, line = self._lines.get_nowait()
        except queue.Empty:
            return

    def stop(self) -> None:
        """Stop every worker: ask it first, and kill it if it does not end in time."""
        for job in self._jobs.values():
            job.process.ask_to_end()
        deadline_s = time.monotonic() + GRACE_S
        for job in self._jobs.values():
            try:
                job.process.wait(max(0.0, deadline_s - time.monotonic()))
            except subprocess.TimeoutExpired:
                job.process.kill()
                job.process.wait()
            job.lock.release()

    def _end(self, job: Job) -> int:
        code = job.process.wait()
        job.lock.release()
        del self._jobs[job.plan.spec.name]
        return code


def _read(name: str, process: Worker, lines: queue.SimpleQueue[tuple[str, bytes]]) -> None:
    """Pass on each whole line that the worker reports, and an empty one at the end."""
    with process.events as events:
        for line in events:
            if line.endswith(b"\n"):  # what a killed worker began is no event
                lines.put((name, line))
    lines.put((name, b""))


def cached(plan: StagePlan, record: RunRecord) -> StageOutcome:
    """Return the outcome of a stage whose result was stored; ``record`` notes what it was computed with."""
    record.cached_with[plan.spec.name] = {} if plan.result is None else plan.result.made_with
    return _with_result(plan, "cached", 0.0)


def ran(plan: StagePlan, seconds: float) -> StageOutcome:
    """Return the outcome of a stage whose result a worker computed."""
    return _with_result(plan, "ran", seconds)


def failed(job: Job, code: int, seconds: float, printed: Path) -> StageOutcome:
    """Return the outcome of a stage whose worker ended with ``code`` and without a result; it printed ``printed``."""
    spec = job.plan.spec
    message = _failure(job.failed, code, printed)
    return StageOutcome(spec.name, spec.declaration.name, job.plan.key, "failed", seconds, None, {}, message)


def _with_result(plan: StagePlan, status: str, seconds: float) -> StageOutcome:
    spec, result = plan.spec, plan.result
    assert result is not None
    artifact = str(result.artifact)
    first = [one.metric for one in spec.declaration.headline if one.metric in result.metrics]
    metrics = {**{name: result.metrics[name] for name in first}, **result.metrics}  # in the order of what is read first
    return StageOutcome(spec.name, spec.declaration.name, plan.key, status, seconds, artifact, metrics)


def _failure(reported: Mapping[str, Any] | None, code: int, printed: Path) -> str:
    if reported is not None and not reported["unexpected"]:
        return str(reported["message"])
    if reported is not None:
        return f"{reported['message']} (unexpected; its traceback is in {printed})"
    if code < 0:
        return (
            f"its worker was ended by {signal.Signals(-code).name}; the same command resumes from the last checkpoint"
        )
    lines = (durable.read_file(printed) or b"").decode(errors="replace").strip().splitlines()
    said = f": {lines[-1]}" if lines else ""
    return f"its worker ended with code {code}{said}; what it printed is in {printed}"
