"""Figures of a stream while it comes: its rate, its gaps, its delay."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

TELL_S = 0.5
GAP_STEPS = 1.5
"""A step so much longer than the usual one is a gap."""

Tell = Callable[..., None]
"""``tell(done, total, **figures)``: seconds of the recording so far, of how many, and named figures."""


def silent(done: int, total: int | None, **figures: float | int | str) -> None:
    """Report nothing."""


class LiveFigures:
    """Report on a stream of ``seconds`` twice a second: ``rate_hz`` and ``delay_ms`` since the last one, all gaps."""

    def __init__(self, tell: Tell, seconds: float) -> None:
        self._tell, self._total = tell, math.ceil(seconds)
        self._came: list[tuple[float, float]] = []
        self._began_s, self._gaps, self._longest_s = math.nan, 0, 0.0

    def add(self, arrival_s: float, stamp_s: float | None = None) -> None:
        """Add one pose or image: its arrival, and its sender's stamp; None if it has none."""
        if math.isnan(self._began_s):
            self._began_s = arrival_s
        self._came.append((arrival_s, arrival_s if stamp_s is None else stamp_s))
        if arrival_s - self._came[0][0] >= TELL_S:
            self._told(told_delay=stamp_s is not None)

    def _told(self, *, told_delay: bool) -> None:
        arrivals, stamps = np.array(self._came).T
        steps = np.diff(stamps)
        self._gaps += int((steps > GAP_STEPS * np.median(steps)).sum())
        self._longest_s = max(self._longest_s, float(steps.max()))
        figures = {
            "rate_hz": round(len(steps) / float(arrivals[-1] - arrivals[0]), 1),
            "gaps": self._gaps,
            "longest_step_ms": round(1e3 * self._longest_s, 1),
        }
        if told_delay:
            figures["delay_ms"] = round(1e3 * float(np.median(arrivals - stamps)), 1)
        self._tell(min(int(arrivals[-1] - self._began_s), self._total - 1), self._total, **figures)
        self._came = self._came[-1:]
