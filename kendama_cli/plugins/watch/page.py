"""``kendama run --watch``: the run as a page in the browser, from the first stage that has to be computed."""

from __future__ import annotations

import contextlib
import functools
import threading
import webbrowser
from collections.abc import Iterator
from typing import TYPE_CHECKING

from kendama_cli.cli import render
from kendama_cli.cli.run_work import Watcher
from kendama_cli.pipeline.plan import Planner
from kendama_cli.pipeline.record import RunRecord
from kendama_cli.pipeline.runner import Observer
from kendama_cli.plugins.shared.web.loopback import Listening, listen

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

    with listening, contextlib.ExitStack() as served:
        status = RunStatus(record, planner.pipeline, view, lambda: _open(served, page, show))
        page = LivePage(listening, status, planner)
        yield status


def _open(served: contextlib.ExitStack, page: LivePage, show: bool) -> None:
    served.enter_context(page)
    render.note(f"watch the run: {page.address}")
    if show:  # a browser that does not return must not keep the run
        threading.Thread(target=webbrowser.open, args=(page.address,), daemon=True).start()
