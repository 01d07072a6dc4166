"""Views of a sweep: one bar for all its runs on a terminal, plain lines elsewhere; and its results."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from kendama_cli.cli import render
from kendama_cli.cli.progress import PlainLines
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.pipeline.runner import Observer, Silent
from kendama_cli.pipeline.sweep import SweepJob

FAILURES_SHOWN = 5
HEADLINES = 4
DIGITS = 4
RUNS_LISTED = 8
"""So many runs are listed one by one at the end; of more, only what they came to together, and those that failed."""


class SweepView:
    """Watcher of the runs of a sweep, which end in threads of their own."""

    def __init__(self, jobs: Sequence[SweepJob], console: Console | None = None) -> None:
        """Draw on ``console`` if that is a terminal; by default standard error."""
        self._console = console or Console(file=sys.stderr)
        self._number = {id(job): i for i, job in enumerate(jobs, 1)}
        self._ends = {id(job): job.planner.pipeline.stages[-1].name for job in jobs}
        self._lock = threading.Lock()
        self._failures: list[str] = []
        self._last, self._began_s, self._done = "", 0.0, 0
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=32),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=self._console,
        )
        self._bar = self._progress.add_task("runs", total=len(jobs), rate="")
        self._live = Live(self._shown(), console=self._console, refresh_per_second=4)

    def __enter__(self) -> Self:
        self._began_s = time.monotonic()
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._console.is_terminal:
            self._live.stop()

    def watch(self, job: SweepJob, record: RunRecord) -> Observer:
        """Return the observer of one run."""
        if not self._console.is_terminal:
            return PlainLines(f"[{self._number[id(job)]}/{len(self._number)} {' '.join(job.overrides)}] ")
        return _OneOfMany(self, " ".join(job.overrides), self._ends[id(job)])

    def ended(self, label: str, outcome: StageOutcome) -> None:
        """Note that a run has ended: its last stage did, or one of its stages failed."""
        with self._lock:
            self._done += 1
            if outcome.status == "failed":
                self._failures.append(f"{label}: {outcome.name}: {outcome.error}")
            else:
                self._last = f"{label}: {render.figures(_numbers(outcome), HEADLINES)}"
            per_minute = 60.0 * self._done / max(time.monotonic() - self._began_s, 1e-6)
            self._progress.update(self._bar, completed=self._done, rate=f"{per_minute:.0f}/min")
            self._live.update(self._shown())

    def _shown(self) -> Group:
        lines = [Text(f"last  {self._last}", style="dim", no_wrap=True, overflow="ellipsis")] if self._last else []
        shown = self._failures[-FAILURES_SHOWN:]
        lines += [Text(f"✗ {failure}", style="red", no_wrap=True, overflow="ellipsis") for failure in shown]
        more = len(self._failures) - len(shown)
        return Group(self._progress, *lines, *([Text(f"✗ and {more} more", style="red")] if more else []))


class _OneOfMany(Silent):
    """Watcher that tells the view of a run's end, and nothing else."""

    def __init__(self, view: SweepView, label: str, last: str) -> None:
        self._view, self._label, self._last = view, label, last

    def stage_ends(self, outcome: StageOutcome) -> None:
        """Note that the stage ran, was cached, or failed."""
        if outcome.status == "failed" or outcome.name == self._last:
            self._view.ended(self._label, outcome)


def _numbers(outcome: StageOutcome) -> dict[str, Any]:
    return {name: value for name, value in outcome.metrics.items() if name != "warnings"}


def show_sweep(records: Sequence[RunRecord], name: str | None = None) -> None:
    """Show the results of the runs: each of a few, else for each setting median and mean over its seeds, with
    intervals of 95 %.

    Runs that failed are always listed, with the reason; ``name`` is the sweep's, for the next command.
    """
    done = [record for record in records if record.outcome == "done"]
    failures = failure_lines(records)
    if len(done) <= RUNS_LISTED:
        rows = [
            (one.run, one.outcome, " ".join(one.overrides), render.figures(_numbers(one.stages[-1]), 5)) for one in done
        ]
        if rows:
            render.table(rows, head=("run", "outcome", "overrides", "last stage"), optional=("outcome",))
    if len(done) > 1:
        _show_means(done)
    for line in failures:
        render.prose(line)
    render.text(f"{len(done)} of {len(records)} runs done{f', {len(failures)} not' if failures else ''}")
    if name is not None:
        render.text(f"see them with: kendama runs --table sweep:{name}")
        render.text(f"or as a page:  kendama report sweep:{name}")


def failure_lines(records: Sequence[RunRecord]) -> list[str]:
    """Return a line for each run that did not end well, with the reason."""
    return [
        f"{record.run} {record.outcome}  {' '.join(record.overrides)}  "
        + next((stage.error for stage in record.stages if stage.error is not None), record.outcome)
        for record in records
        if record.outcome != "done"
    ]


def _show_means(done: Sequence[RunRecord]) -> None:
    from kendama_cli.report.run_table import RunFacts, run_table  # noqa: PLC0415 - numpy

    stage = done[0].stages[-1]
    metrics = [f"{stage.name}.{name}" for name in list(_numbers(stage))[:HEADLINES]]
    table = run_table([RunFacts.of(record.document()) for record in done], metrics)
    rows = []
    for row in table.rows:
        pairs = [f"{key}={value}" for key, value in zip(table.settings, row.settings, strict=True)]
        found = [(name, one) for name, one in zip(metrics, row.estimates, strict=True) if one is not None and one.n > 1]
        setting, runs = " ".join(pairs) or "all", str(len(row.runs))
        rows += [(setting, runs, name.removeprefix(f"{stage.name}."), one.texts(DIGITS)) for name, one in found]
    if rows:
        render.table(rows, head=("setting", "runs", "metric", "median; mean [95 %]"))
