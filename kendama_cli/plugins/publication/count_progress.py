"""Progress of work that is counted: a bar on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from kendama_cli.cli import render
from kendama_cli.cli.progress import LINE_PERIOD_S


@contextlib.contextmanager
def counted(name: str, unit: str) -> Iterator[Callable[[int, int], None]]:
    """Show what the block tells of ``name``: how many ``unit`` are done, and of how many."""
    if not sys.stderr.isatty():
        told_s = time.monotonic()

        def say(done: int, total: int) -> None:
            nonlocal told_s
            if done < total and time.monotonic() - told_s >= LINE_PERIOD_S:
                told_s = time.monotonic()
                render.note(f"{name}: {done}/{total} {unit}")

        yield say
        return
    columns = (TextColumn("{task.description}"), BarColumn(bar_width=24), MofNCompleteColumn(), TextColumn(unit))
    with Progress(*columns, TimeElapsedColumn(), TimeRemainingColumn(), console=Console(stderr=True)) as shown:
        bar = shown.add_task(name, total=None)
        yield lambda done, total: shown.update(bar, completed=done, total=total)
