"""Views of a run: a live view on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Any, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskID, TextColumn
from rich.table import Column
from rich.text import Text

from kendama_cli.cli import render
from kendama_cli.pipeline.plan import NEVER_RAN
from kendama_cli.pipeline.record import StageOutcome

LINE_PERIOD_S = 5.0
SHOWN_REASONS = 3


class PlainLines:
    """One line when a stage starts and ends, and one every few seconds between."""

    def __init__(self, prefix: str = "") -> None:
        """Store ``prefix``, which distinguishes the runs of a sweep."""
        self._prefix = prefix
        self._told_s: dict[str, float] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it is."""

    def stage_waits(self, name: str) -> None:
        """Print that another run on this home is computing the stage."""
        self._say(f"{name}: waits for another run that is computing it")

    def stage_starts(self, name: str, key: str | None, reasons: tuple[str, ...]) -> None:
        """Print that a worker for the stage has started."""
        self._told_s[name] = time.monotonic()
        why = _why(reasons) or "goes on"
        self._say(f"{name}: {why if why == 'starting' else f'starts ({why})'}")

    def stage_progress(self, name: str, done: int, total: int | None, figures: Mapping[str, Any]) -> None:
        """Print the progress that the stage reports."""
        now = time.monotonic()
        if now - self._told_s.get(name, 0.0) >= LINE_PERIOD_S:
            self._told_s[name] = now
            of = "" if total is None else f"/{total}"
            shown = render.figures(figures)
            self._say(f"{name}: {done}{of}{', ' + shown if shown else ''}")

    def stage_ends(self, outcome: StageOutcome) -> None:
        """Print that the stage ran, was cached, or failed."""
        if outcome.status == "failed":
            self._say(f"{outcome.name}: failed: {outcome.error}")
        elif outcome.status == "ran":
            self._say(f"{outcome.name}: done in {outcome.seconds:.1f} s; {render.figures(outcome.metrics, 4)}")
        else:
            self._say(f"{outcome.name}: cached")

    def ask(self, question: str) -> str | None:
        """Return the person's answer to ``question``; None at the end of input."""
        return _answered(question)

    def _say(self, line: str) -> None:
        render.note(self._prefix + line)


class _Figures(ProgressColumn):
    """The stage's own figures, in the rest of the line."""

    def render(self, task: Task) -> Text:
        return Text(str(task.fields.get("shown", "")), style="" if task.finished else "dim", no_wrap=True)


class _Times(ProgressColumn):
    """Time that a stage has taken, and that it will take on from here."""

    def render(self, task: Task) -> Text:
        spent_s = task.finished_time if task.finished else task.elapsed
        left_s = None if task.finished else task.time_remaining
        left = "" if left_s is None else f", {_duration(left_s)} left"
        return Text("" if spent_s is None else f"{_duration(spent_s)}{left}", style="cyan")


class LiveView:
    """A line per stage, in the pipeline's order: state, bar, time spent and left, figures."""

    def __init__(self, stages: Sequence[str] = ()) -> None:
        """Prepare lines for ``stages``; each shows when something happens to it."""
        self._console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.fields[mark]} {task.description:<9}"),
            BarColumn(bar_width=12),
            _Times(table_column=Column(no_wrap=True)),
            _Figures(table_column=Column(ratio=1, no_wrap=True, overflow="ellipsis")),
            console=self._console,
            expand=True,
        )
        self._started: set[TaskID] = set()
        self._tasks = {name: self._added(name) for name in stages}

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()

    def ask(self, question: str) -> str | None:
        """Return the person's answer to ``question``, asked below the view; None at the end of input."""
        self._progress.stop()
        try:
            return _answered(question)
        finally:
            rows = sum(task.visible for task in self._progress.tasks)
            self._console.print("\n" * (rows - 1), end="")  # the view is drawn anew over these, not over the question
            self._progress.start()

    def stage_waits(self, name: str) -> None:
        """Show that another run on this home is computing the stage."""
        self._progress.update(self._row(name), mark="…", shown="another run is computing it")

    def stage_starts(self, name: str, key: str | None, reasons: tuple[str, ...]) -> None:
        """Show that a worker for the stage has started."""
        self._progress.update(self._row(name), mark="▸", shown=_why(reasons))

    def stage_progress(self, name: str, done: int, total: int | None, figures: Mapping[str, Any]) -> None:
        """Show the progress that the stage reports."""
        of = "" if total is None else f"/{total}"
        shown = f"{done}{of}  {render.figures(figures)}"
        self._progress.update(self._row(name), completed=done, total=total, shown=shown)

    def stage_ends(self, outcome: StageOutcome) -> None:
        """Show that the stage ran, was cached, or failed."""
        mark = {"ran": "✓", "cached": "=", "failed": "✗"}[outcome.status]
        # why it failed is told whole in the closing lines
        shown = outcome.status if outcome.status == "failed" else briefly(outcome)
        row = self._row(outcome.name)
        if outcome.status == "failed":
            self._progress.update(row, mark=mark, shown=shown)
        else:
            self._progress.update(row, mark=mark, completed=1, total=1, shown=shown)
        self._progress.stop_task(row)

    def _row(self, name: str) -> Any:
        if name not in self._tasks:
            self._tasks[name] = self._added(name)
        task = self._tasks[name]
        if task not in self._started:
            self._started.add(task)
            self._progress.start_task(task)
            self._progress.update(task, visible=True)
        return task

    def _added(self, name: str) -> TaskID:
        return self._progress.add_task(name, start=False, total=None, visible=False, mark=" ", shown="")


def briefly(outcome: StageOutcome) -> str:
    """Return the result of a stage in the first words of its declaration that fit, else its first two metrics."""
    return render.declared_words(outcome.stage, "brief", outcome.metrics) or render.figures(outcome.metrics, 2)


def _answered(question: str) -> str | None:
    render.note(f"{question}:")
    line = sys.stdin.readline()
    return line.strip() if line else None


def _duration(seconds: float) -> str:
    minutes, rest_s = divmod(round(seconds), 60)
    return f"{minutes} min {rest_s:02d} s" if minutes else f"{rest_s} s"


def _why(reasons: tuple[str, ...]) -> str:
    """Return the first reasons only: another robot changes two dozen values, and ``kendama plan`` shows them all.

    Of a stage that runs it is no news that it never ran.
    """
    if reasons == NEVER_RAN:
        return "starting"
    more = len(reasons) - SHOWN_REASONS
    return "; ".join((*reasons[:SHOWN_REASONS], *([f"{more} more in 'kendama plan'"] if more > 0 else [])))


def observer(stages: Sequence[str] = ()) -> LiveView | PlainLines:
    """Return the live view of ``stages`` if standard error is a terminal, else plain lines."""
    return LiveView(stages) if sys.stderr.isatty() else PlainLines()
