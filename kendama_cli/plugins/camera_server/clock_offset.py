"""Difference between two machines' clocks, from questions and answers."""

from __future__ import annotations

from collections import deque

KEPT, ENOUGH = 200, 8
"""Exchanges that are remembered: some seconds, in which clocks drift by microseconds; so many are enough to begin."""


class ClockOffset:
    """Offset of the other clock from ours by the quickest of the newest exchanges.

    offset = ((t1 - t0) + (t2 - t3)) / 2 of an exchange that left at t0, came at t1 and was answered at t2 on the other
    clock, and was back at t3; it is wrong by at most half of the delay (t3 - t0) - (t2 - t1) (RFC 5905, section 8).
    """

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float]] = deque(maxlen=KEPT)

    def add(self, left_s: float, came_s: float, answered_s: float, back_s: float) -> None:
        """Take the four times of an exchange [s]."""
        delay_s = (back_s - left_s) - (answered_s - came_s)
        self._seen.append((delay_s, ((came_s - left_s) + (answered_s - back_s)) / 2))

    @property
    def known(self) -> bool:
        """Return True after enough exchanges."""
        return len(self._seen) >= ENOUGH

    @property
    def offset_s(self) -> float:
        """Return the other clock's time less ours [s]; raises ValueError before the first exchange."""
        return min(self._seen)[1]
