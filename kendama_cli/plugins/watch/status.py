"""Progress of a run: an observer that stores the events it receives, for other threads to read."""

from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from kendama_cli.pipeline.catalogue import Pipeline
from kendama_cli.pipeline.plan import NEVER_RAN
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.pipeline.runner import Observer
from kendama_cli.report.tables import label_and_unit, number

_SHOWN_METRICS = 4


@dataclasses.dataclass(frozen=True)
class StageStatus:
    """One stage: ``state`` is '' before it begins, then waits, runs, and at last ran, cached or failed."""

    name: str
    title: str
    state: str = ""
    key: str | None = None
    note: str = ""
    done: int = 0
    total: int | None = None
    figures: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    began_s: float | None = None
    seconds: float | None = None
    artifact: str | None = None


class RunStatus:
    """The Observer of one run, which reports to ``view`` too; ``version`` counts its events.

    ``first`` is called when the first stage has to be computed.
    """

    def __init__(self, record: RunRecord, pipeline: Pipeline, view: Observer, first: Callable[[], None]) -> None:
        self._record, self._view, self._first = record, view, first
        self._lock = threading.Lock()
        self._stages = {spec.name: StageStatus(spec.name, spec.declaration.title) for spec in pipeline.stages}
        self._outcome = "running"
        self.version = 1

    @property
    def stages(self) -> list[StageStatus]:
        """Every stage as it is now, in the pipeline's order."""
        with self._lock:
            return list(self._stages.values())

    @property
    def reached(self) -> str:
        """Return the end of the run as its record states it."""
        return self._record.outcome

    def stage_waits(self, name: str) -> None:
        """Note that another run on this home is computing the stage."""
        self._view.stage_waits(name)
        self._tell(name, state="waits", note="another run is computing it")

    def stage_starts(self, name: str, key: str | None, reasons: tuple[str, ...]) -> None:
        """Note that a worker for the stage has started."""
        first, self._first = self._first, _nothing
        first()
        self._view.stage_starts(name, key, reasons)
        self._tell(
            name,
            state="runs",
            key=key,
            note="starting" if reasons == NEVER_RAN else "; ".join(reasons),
            began_s=time.monotonic(),
        )

    def stage_progress(self, name: str, done: int, total: int | None, figures: Mapping[str, Any]) -> None:
        """Note the progress that the stage reports."""
        self._view.stage_progress(name, done, total, figures)
        self._tell(name, done=done, total=total, figures=figures)

    def stage_ends(self, outcome: StageOutcome) -> None:
        """Note that the stage ran, was cached, or failed."""
        self._view.stage_ends(outcome)
        metrics = {name: value for name, value in outcome.metrics.items() if name != "warnings"}
        self._tell(
            outcome.name,
            state=outcome.status,
            note=outcome.error or "",
            figures=dict(list(metrics.items())[:_SHOWN_METRICS]),
            seconds=outcome.seconds,
            artifact=outcome.artifact,
        )

    def ends(self, outcome: str) -> None:
        """Note that the run has ended: done, failed or interrupted."""
        with self._lock:
            self._outcome = outcome
            self.version += 1

    def document(self) -> dict[str, Any]:
        """Return the status as JSON values, for the page."""
        now_s = time.monotonic()
        with self._lock:
            return {
                "version": self.version,
                "run": self._record.run,
                "pipeline": self._record.pipeline,
                "overrides": self._record.overrides,
                "outcome": self._outcome,
                "stages": [_document(stage, now_s) for stage in self._stages.values()],
            }

    def _tell(self, name: str, **said: Any) -> None:
        with self._lock:
            self._stages[name] = dataclasses.replace(self._stages[name], **said)
            self.version += 1


def _nothing() -> None:
    """Do what is done when a later stage starts."""


def _document(stage: StageStatus, now_s: float) -> dict[str, Any]:
    seconds = now_s - stage.began_s if stage.state == "runs" and stage.began_s is not None else stage.seconds
    return {
        "name": stage.name,
        "title": stage.title,
        "state": stage.state,
        "note": stage.note,
        "done": stage.done,
        "total": stage.total,
        "seconds": None if seconds is None else round(seconds, 1),
        "figures": [_labelled(name, value) for name, value in stage.figures.items()],
    }


def _labelled(name: str, value: Any) -> list[str]:
    label, unit = label_and_unit(name)
    return [label, f"{number(value)} {unit}".strip()]
