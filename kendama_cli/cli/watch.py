"""``kendama run --watch``: the run as a page in the browser, from the first stage that has to be computed."""

from __future__ import annotations

import contextlib
import threading
import webbrowser
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from kendama_cli.cli import render
from kendama_cli.pipeline.plan import Planner
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.pipeline.runner import Observer
from kendama_cli.system.listening import Listening, listen

if TYPE_CHECKING:
    from kendama_cli.pipeline.live.server import LivePage

LOOPBACK = "127.0.0.1"


@dataclass(frozen=True)
class WatchOptions:
    """``port`` 0 takes a free one; ``show``: whether the browser is opened."""

    port: int
    show: bool

    def opened(self) -> OpenedWatch:
        """Take the port; raises UsageError where it is taken."""
        return OpenedWatch(listen(LOOPBACK, self.port), self.show)


@dataclass(frozen=True)
class OpenedWatch:
    """A port that listens already, and whether the browser is to be opened."""

    listening: Listening
    show: bool


@contextlib.contextmanager
def with_page(view: Observer, opened: OpenedWatch | None, record: RunRecord, planner: Planner) -> Iterator[Observer]:
    """Yield an observer that reports to ``view`` and, if one was ``opened``, to the page, which is served meanwhile."""
    if opened is None:
        yield view
        return
    from kendama_cli.pipeline.live.server import LivePage  # noqa: PLC0415 - pandas and matplotlib
    from kendama_cli.pipeline.live.status import RunStatus  # noqa: PLC0415

    status = RunStatus(record, planner.pipeline)
    with opened.listening, contextlib.ExitStack() as served:
        page = LivePage(opened.listening, status, planner)
        yield _Both(view, status, lambda: _open(served, page, opened.show))


def _open(served: contextlib.ExitStack, page: LivePage, show: bool) -> None:
    served.enter_context(page)
    render.note(f"watch the run: {page.address}")
    if show:  # a browser that does not return must not keep the run
        threading.Thread(target=webbrowser.open, args=(page.address,), daemon=True).start()


class _Both:
    """Watcher that tells a view and the page's status; calls ``first`` when the first stage has to be computed."""

    def __init__(self, view: Observer, status: Observer, first: Callable[[], None]) -> None:
        self._observers = (view, status)
        self._first: Callable[[], None] | None = first

    def stage_waits(self, name: str) -> None:
        """Report to both that another run on this home is computing the stage."""
        for one in self._observers:
            one.stage_waits(name)

    def stage_starts(self, name: str, key: str | None, reasons: tuple[str, ...]) -> None:
        """Report to both that a worker for the stage has started."""
        first, self._first = self._first, None
        if first is not None:
            first()
        for one in self._observers:
            one.stage_starts(name, key, reasons)

    def stage_progress(self, name: str, done: int, total: int | None, figures: Mapping[str, Any]) -> None:
        """Report to both the progress of the stage."""
        for one in self._observers:
            one.stage_progress(name, done, total, figures)

    def stage_ends(self, outcome: StageOutcome) -> None:
        """Report to both that the stage ran, was cached, or failed."""
        for one in self._observers:
            one.stage_ends(outcome)
