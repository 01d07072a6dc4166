"""``kendama run --watch``: the run as a page in the browser, from the first stage that has to be computed."""

from __future__ import annotations

import contextlib
import functools
import threading
import webbrowser
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from kendama_cli.cli import render
from kendama_cli.cli.run_work import Watcher
from kendama_cli.pipeline.plan import Planner
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.pipeline.runner import Observer
from kendama_cli.plugins.shared.web.listening import Listening, listen

if TYPE_CHECKING:
    from kendama_cli.plugins.watch.server import LivePage

LOOPBACK = "127.0.0.1"


def watcher(port: int, *, show: bool) -> Watcher:
    """Take the port (0: a free one), and return the watcher of a run; raises UsageError where the port is taken.

    ``show``: the browser is opened.
    """
    return functools.partial(_with_page, listen(LOOPBACK, port), show)


@contextlib.contextmanager
def _with_page(
    listening: Listening, show: bool, view: Observer, record: RunRecord, planner: Planner
) -> Iterator[Observer]:
    """Yield an observer that reports to ``view`` and to the page, which is served meanwhile."""
    from kendama_cli.plugins.watch.server import LivePage  # noqa: PLC0415 - pandas and matplotlib
    from kendama_cli.plugins.watch.status import RunStatus  # noqa: PLC0415

    status = RunStatus(record, planner.pipeline)
    with listening, contextlib.ExitStack() as served:
        page = LivePage(listening, status, planner)
        yield _Both(view, status, lambda: _open(served, page, show))


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
