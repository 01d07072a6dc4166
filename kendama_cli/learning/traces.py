"""Eligibility traces: which earlier choices share in what happens now (equations.md eq. 7).

Every law first fades all traces by gamma lambda, then marks the visited entry: *replacing* sets it to 1 (Singh and
Sutton 1996; the paper's choice), *accumulating* adds 1, *dutch* adds 1 after shrinking it by 1 - alpha (van Seijen
and Sutton 2014), which together with a correction of the update makes it the online lambda-return exactly.
"""

from __future__ import annotations

from typing import Literal, Protocol

TraceName = Literal["replacing", "accumulating", "dutch"]


class TraceLaw(Protocol):
    """One of the laws."""

    exact: bool
    """Whether the update is corrected for how the value of the state has changed since it was looked ahead to."""

    def marked(self, faded: float, alpha: float) -> float:
        """Return the new trace of an entry that was chosen, from its trace ``faded`` just now."""


class Replacing:
    """e = 1."""

    exact = False

    def marked(self, faded: float, alpha: float) -> float:
        """Return 1, however often the state occurred before."""
        return 1.0


class Accumulating:
    """e = e + 1."""

    exact = False

    def marked(self, faded: float, alpha: float) -> float:
        """Return the trace plus one."""
        return faded + 1.0


class Dutch:
    """e = (1 - alpha) e + 1."""

    exact = True

    def marked(self, faded: float, alpha: float) -> float:
        """Return the trace plus one, minus the amount that this update itself will add."""
        return faded + (1.0 - alpha * faded)


TRACES: dict[TraceName, TraceLaw] = {"replacing": Replacing(), "accumulating": Accumulating(), "dutch": Dutch()}
