"""Receiver of the figures and tables of a report while they are made for files instead of a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

    from kendama_cli.report.grid import Cell


class Receiver(Protocol):
    """Taker of finished figures and tables; ``source`` names the runs that they show."""

    @property
    def source(self) -> str:
        """Return the runs and the version in a few words."""

    def chapter(self, stage: str) -> Any:
        """Note that what follows is of ``stage``."""

    def width_in(self, *, wide: bool) -> float:
        """Return the width of a figure in print [in]; ``wide`` ones may take both columns."""

    def figure(self, name: str, canvas: Canvas) -> Any:
        """Take a laid-out figure."""

    def captions(self, by_name: Mapping[str, str]) -> Any:
        """Take the captions of figures by their names."""

    def grid(self, name: str, title: str, head: Sequence[str], rows: Sequence[Sequence[Cell]]) -> Any:
        """Take a table."""


_receiver: ContextVar[Receiver | None] = ContextVar("receiver", default=None)


def receiving() -> Receiver | None:
    """Return the receiver of the block; None where a page is made."""
    return _receiver.get()


@contextmanager
def made_for(receiver: Receiver) -> Iterator[None]:
    """Give every figure and table that the block makes to ``receiver``."""
    before = _receiver.set(receiver)
    try:
        yield
    finally:
        _receiver.reset(before)
