"""Sweeps: one run for each distinct combination of overrides, several at a time, sharing stages through the store."""

from __future__ import annotations

import concurrent.futures
import contextlib
import queue
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from kendama_cli.errors import KendamaError
from kendama_cli.pipeline.plan import Planner
from kendama_cli.pipeline.record import RunRecord, begin, next_number, versions
from kendama_cli.pipeline.runner import Observer, Runner
from kendama_cli.store.durable import canonical_json
from kendama_cli.system.interface import Starter, system


@dataclass(frozen=True)
class SweepJob:
    """One combination: its overrides and its planner."""

    overrides: list[str]
    planner: Planner


def distinct(jobs: Sequence[SweepJob]) -> list[SweepJob]:
    """Return ``jobs`` without those whose stages would all have the same settings as an earlier one's."""
    seen: dict[bytes, SweepJob] = {}
    for job in jobs:
        stages = job.planner.pipeline.stages
        parts = [job.planner.parts(spec, {}) for spec in stages]
        seen.setdefault(canonical_json(parts), job)
    return list(seen.values())


def run_sweep(
    jobs: Sequence[SweepJob],
    observe: Callable[[SweepJob, RunRecord], Observer],
    *,
    at_once: int,
    cluster: Starter | None = None,
    name: str | None = None,
) -> list[RunRecord]:
    """Run every job, ``at_once`` together; a failed one does not stop the others. Records in the order of ``jobs``.

    ``name`` is the sweep's in their records. Stages that do nothing but compute go to ``cluster`` where there is one.

    A KendamaError other than a failed stage (a full disk) stops the sweep and is raised, as KeyboardInterrupt is.
    """
    stop = threading.Event()
    starters: queue.SimpleQueue[Starter] = queue.SimpleQueue()

    first = next_number(jobs[0].planner.store.home) if jobs else 0
    installed = versions()

    def run(number: int, job: SweepJob) -> RunRecord:
        home, pipeline = job.planner.store.home, job.planner.pipeline.name
        record = begin(home, pipeline, job.overrides, installed, number=number, sweep=name)
        starter = starters.get()
        try:
            view = observe(job, record)
            return Runner(job.planner, record, view, workers=1, starter=starter, cluster=cluster, stop=stop).run()
        finally:
            starters.put(starter)

    with contextlib.ExitStack() as stack, concurrent.futures.ThreadPoolExecutor(at_once) as pool:
        for _ in range(min(at_once, len(jobs))):
            starter = system().sweep_starter() if cluster is None else system().interpreters()
            starters.put(stack.enter_context(contextlib.closing(starter)))
        futures = [pool.submit(run, number, job) for number, job in enumerate(jobs, first)]
        try:
            return [future.result() for future in futures]
        except (KeyboardInterrupt, KendamaError):
            stop.set()
            for future in futures:
                future.cancel()
            raise
