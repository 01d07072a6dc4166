"""Runner of a pipeline: looks up what is there, starts one worker process for each other stage, keeps the record.

Stages that do not wait for each other run side by side. A lock per key lets two runs on one home compute a shared
stage once; where locks are inherited, the worker holds it too, so it outlives a killed parent.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from kendama_cli.errors import KendamaError
from kendama_cli.pipeline.artifact_place import broken_off_log
from kendama_cli.pipeline.catalogue import StageSpec
from kendama_cli.pipeline.plan import Planner, StagePlan, made_since
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.pipeline.workers import Ask, Job, Workers, cached, failed, ran
from kendama_cli.store import durable
from kendama_cli.system.interface import Lock, Starter, system

POLL_S = 0.1


class Observer(Protocol):
    """Observer of a run: a live view, plain lines, or nothing."""

    def stage_waits(self, name: str) -> None:
        """Note that another run on this home is computing the stage."""

    def stage_starts(self, name: str, key: str | None, reasons: tuple[str, ...]) -> None:
        """Note that a worker has started that computes ``key``, for the stage ``name``."""

    def stage_progress(self, name: str, done: int, total: int | None, figures: Mapping[str, Any]) -> None:
        """Note the progress that the stage reports."""

    def stage_ends(self, outcome: StageOutcome) -> None:
        """Note that the stage ran, was cached, or failed."""


class Silent:
    """An observer that says nothing."""

    def stage_waits(self, name: str) -> None: ...

    def stage_starts(self, name: str, key: str | None, reasons: tuple[str, ...]) -> None: ...

    def stage_progress(self, name: str, done: int, total: int | None, figures: Mapping[str, Any]) -> None: ...

    def stage_ends(self, outcome: StageOutcome) -> None: ...


class Runner:
    """One run of one pipeline."""

    def __init__(
        self,
        planner: Planner,
        record: RunRecord,
        observer: Observer,
        *,
        forced: frozenset[str] = frozenset(),
        workers: int | None = None,
        starter: Starter | None = None,
        cluster: Starter | None = None,
        stop: threading.Event | None = None,
        ask: Ask | None = None,
    ) -> None:
        """Set the limits: ``workers`` stages compute at once, None for one per core; ``stop`` interrupts.

        ``starter`` makes the worker processes, by default an interpreter each; a fork server serves one at a time.
        Stages that do nothing but compute go to ``cluster`` where there is one; ``ask`` answers a stage's questions.
        """
        self._planner = planner
        self._record = record
        self._observer = observer
        self._forced = set(forced)
        self._workers = workers or os.cpu_count() or 1
        self._stop = stop or threading.Event()
        self._plans: dict[str, StagePlan] = {}
        self._failed: set[str] = set()
        self._has_computed = False
        self._waiting: dict[str, StageSpec] = {spec.name: spec for spec in planner.pipeline.stages}
        self._starter = starter or system().interpreters()
        self._cluster = cluster
        self._running = Workers(ask)
        self._held = contextlib.ExitStack()
        self._waits_reported: set[str] = set()

    def run(self) -> RunRecord:
        """Run to the end; ``outcome`` is then done or failed, or interrupted before KeyboardInterrupt is raised.

        Where the home cannot be written a run with nothing to compute is not recorded; any other raises StoreError.
        """
        with self._planner.store.in_use(), self._held:
            return self._run()

    def _run(self) -> RunRecord:
        try:
            while self._waiting or self._running:
                if self._stop.is_set():
                    raise KeyboardInterrupt
                waited_before = len(self._waiting)
                self._start_ready()
                if self._running:
                    self._listen()
                elif self._waiting:
                    if not _startable(self._waiting, self._plans):
                        break
                    if len(self._waiting) == waited_before:  # another run is computing what they wait for
                        time.sleep(POLL_S)
        except (KeyboardInterrupt, KendamaError) as error:
            self._running.stop()
            self._record.outcome = "failed" if isinstance(error, KendamaError) else "interrupted"
            if isinstance(error, KendamaError) and not self._has_computed:
                self._record.withdraw()
            with contextlib.suppress(KendamaError):  # a full disk may not take this either
                self._record.save()
            raise
        _put_in_order(self._record.stages, self._planner.pipeline.stages)
        if self._failed and not self._has_computed:
            self._record.withdraw()
        self._record.end("failed" if self._failed else "done")
        return self._record

    def _start_ready(self) -> None:
        for spec in _startable(self._waiting, self._plans):
            inputs = {own: _given(self._plans[needed]) for own, needed in spec.needs.items()}
            plan = self._planner.look_up(spec, inputs, forced=spec.name in self._forced)
            if plan.result is not None:
                self._finish_cached(plan)
            elif len(self._running) < self._workers:
                self._record.begin(self._held)
                self._start_locked(plan)

    def _start_locked(self, plan: StagePlan) -> None:
        """Start a worker, or leave the stage waiting while another run holds its key."""
        name = plan.spec.name
        lock = _try_lock(self._planner.store.home, plan)
        if lock is None:
            if name not in self._waits_reported:
                self._waits_reported.add(name)
                self._observer.stage_waits(name)
            return
        # whoever held the lock may have finished between our look and the lock
        made = made_since(self._planner, plan)
        if made is None:
            self._start(plan, lock)
        else:
            lock.release()
            self._finish_cached(made)

    def _start(self, plan: StagePlan, lock: Lock) -> None:
        spec = plan.spec
        request = _request(self._planner, plan, self._plans, fresh=spec.name in self._forced)
        away = self._cluster if self._planner.kind(spec.name) == "computes" else None
        request |= _here(self._record, spec.name, self._running) if away is None else {}
        output = durable.make_folder(self._record.folder) / f"{spec.name}.txt"
        self._running.start(away or self._starter, plan, request, lock=lock, output=output)
        self._waiting.pop(spec.name)
        self._forced.discard(spec.name)
        self._observer.stage_starts(spec.name, plan.key, plan.reasons)

    def _listen(self) -> None:
        for job, event in self._running.events(POLL_S):
            if event["event"] == "progress":
                self._observer.stage_progress(job.plan.spec.name, event["done"], event["total"], event["figures"])
            elif event["event"] == "done":
                job.done = event
            elif event["event"] == "failed":
                job.failed = event
            else:
                self._finish(job, event["code"])

    def _finish(self, job: Job, code: int) -> None:
        name = job.plan.spec.name
        # on a cluster a stage may wait longer for a worker than it computes
        seconds = float((job.done or {}).get("seconds", time.monotonic() - job.started_s))
        refused = job.failed is not None and job.failed.get("refused") and job.plan.spec.declaration.kind != "moves"
        self._has_computed |= not refused
        result = None if job.done is None or job.plan.key is None else self._planner.store.find(name, job.plan.key)
        if result is not None:
            self._plans[name] = made = dataclasses.replace(job.plan, result=result)
            if job.done is not None and not job.done.get("shared"):
                self._planner.store.share(result)
            self._planner.remember(job.plan)
            self._end(ran(made, seconds))
        else:
            self._failed.add(name)
            self._end(failed(job, code, seconds, self._record.folder / f"{name}.txt"))

    def _finish_cached(self, plan: StagePlan) -> None:
        self._waiting.pop(plan.spec.name)
        self._plans[plan.spec.name] = plan
        self._planner.remember(plan)
        self._end(cached(plan, self._record))

    def _end(self, outcome: StageOutcome) -> None:
        self._record.stages.append(outcome)
        self._observer.stage_ends(outcome)
        if outcome.status != "cached" and (self._waiting or self._running):  # else the run's end is written next
            self._record.save()


def _here(record: RunRecord, name: str, workers: Workers) -> dict[str, Any]:
    """Return what a worker is told that runs here: what records a person or moves an arm runs where they are."""
    return {"broken_off": str(broken_off_log(record.folder, name)), "attended": workers.attended}


def _put_in_order(outcomes_of: list[StageOutcome], specs: Sequence[StageSpec]) -> None:
    """Sort outcomes as the pipeline has their stages."""
    names = [spec.name for spec in specs]
    outcomes_of.sort(key=lambda outcome: names.index(outcome.name))


def _startable(waiting: Mapping[str, StageSpec], plans: Mapping[str, StagePlan]) -> list[StageSpec]:
    """Return those of ``waiting`` whose inputs are there."""
    return [spec for spec in waiting.values() if all(name in plans for name in spec.needs.values())]


def _given(plan: StagePlan) -> str:
    """Return the digest of the output of a stage that has ended."""
    assert plan.result is not None
    return plan.result.content_digest


def _try_lock(home: Path, plan: StagePlan) -> Lock | None:
    """Return the lock of the result that ``plan`` computes; None while another run holds it."""
    path = durable.make_folder(home / "locks") / f"{plan.spec.name}-{plan.key}.lock"
    with durable.plain_disk_errors(path):
        return system().try_lock(path)


def _request(planner: Planner, plan: StagePlan, plans: Mapping[str, StagePlan], *, fresh: bool) -> dict[str, Any]:
    """Return the request to the worker of ``plan`` as JSON values; ``plans`` holds the stages that it needs."""
    spec = plan.spec
    given = {own: plans[needed] for own, needed in spec.needs.items()}
    return {
        "declared": spec.declaration.name,
        "stage": spec.name,
        "key": plan.key,
        "parts": plan.parts,
        "settings": {
            own: {"name": node, "value": dataclasses.asdict(planner.settings[spec.name][own])}
            for own, node in spec.config.items()
        },
        "given": {
            own: {
                "folder": str(one.result.artifact),
                "returns": one.spec.declaration.returns,
                "stage": one.spec.name,
                "key": one.key,
            }
            for own, one in given.items()
            if one.result is not None
        },
        "files": planner.files(spec.name),
        "seed": planner.seed if spec.seeded else None,
        "home": str(planner.store.home),
        # nor is anything resumed that other code may have begun
        "fresh": fresh or (planner.kind(spec.name) != "moves" and not planner.is_cached(spec.name)),
    }
