"""The loop's equal periods, and the stop where the force on the hand is too old for too long."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

from kendama_cli.errors import HardwareError
from kendama_cli.simulation.dart.world import STEP_S

SLEEP_SHORT_S = 0.0003
"""A sleeping process wakes up to so late; the rest of a period is waited for without sleeping."""
PATIENCE_S = 0.02
"""A shorter gap between two places is made good: the way is known before and after it, and predicted in it."""
TOLD_S, WINDOW_S = 0.005, 1.0


class Period:
    """Waits for the next of equal periods, and appends to ``late_s`` how late each began.

    ``began_s`` is when the present one was to begin.
    """

    def __init__(self, clock: Callable[[], float], late_s: list[float]) -> None:
        self._clock, self._late_s, self.began_s = clock, late_s, clock()

    def wait(self) -> int:
        """Return at a period's beginning: how many have begun since the last one, 1 but for a stall."""
        while (left_s := self.began_s + STEP_S - self._clock()) > 0:
            if left_s > SLEEP_SHORT_S:
                time.sleep(left_s - SLEEP_SHORT_S)
        self._late_s.append(-left_s)
        due = 1 + math.floor(-left_s / STEP_S)
        self.began_s += STEP_S * due
        return due


class Lateness:
    """Counts for how long a hand felt a force that did not know where it was.

    The force is held from one place that is heard of to the next. One gap longer than ``most_s``, or gaps whose excess
    over PATIENCE_S adds up to it within WINDOW_S, is a link that no swing is made of.
    """

    def __init__(self, most_s: float, now_s: float) -> None:
        self._most_s, self._looked_s, self._heard_s, self._stalled_s = most_s, now_s, now_s, 0.0
        self._gaps: deque[tuple[float, float, float]] = deque()

    def look(self, now_s: float, *, heard: bool) -> None:
        """Look once a period, in which a position was ``heard`` of or none; raises HardwareError for such a link."""
        self._stalled_s += max(0.0, now_s - self._looked_s - 2 * STEP_S)
        self._looked_s = now_s
        if not heard:  # the link's own watchdog looks at silence that goes on
            return
        gap_s, stalled_s = now_s - self._heard_s, self._stalled_s
        self._heard_s, self._stalled_s = now_s, 0.0
        if gap_s > TOLD_S:
            self._gaps.append((now_s, gap_s, stalled_s))
        while self._gaps and self._gaps[0][0] < now_s - WINDOW_S:
            self._gaps.popleft()
        if sum(max(0.0, gap_s - PATIENCE_S) for _, gap_s, _ in self._gaps) > self._most_s - PATIENCE_S:
            raise HardwareError(f"the haptic link stutters: {self.words()}")

    def words(self) -> str:
        """Return a sentence about recent lateness and its cause; empty if it was in time."""
        if not self._gaps:
            return ""
        gaps_s, stalled_s = [gap_s for _, gap_s, _ in self._gaps], sum(ours_s for _, _, ours_s in self._gaps)
        many = f"{len(gaps_s)} gaps of up to" if len(gaps_s) > 1 else "a gap of"
        why = (
            "this computer was busy: end what else runs on it"
            if stalled_s > 0.5 * sum(gaps_s)
            else "its places came late: look at the network and the device's server"
        )
        told = f"{many} {1e3 * max(gaps_s):.0f} ms within {WINDOW_S:g} s, as {why}"
        return f"{told}, or allow more by capture.watchdog_s"
