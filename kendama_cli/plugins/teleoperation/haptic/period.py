"""The loop's equal periods, the path of the stylus in them, and the stop where the force is too old for long."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence

from kendama_cli.errors import HardwareError
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.world import STEP_S

SLEEP_SHORT_S = 0.0003
"""A sleeping process wakes up to so late; the rest of a period is waited for without sleeping."""
PATIENCE_S = 0.02
"""A shorter gap between two places is made good: the way is known before and after it, and predicted in it."""
TOLD_S, WINDOW_S = 0.005, 1.0
PREDICTED_S = 0.02
"""A stylus that is not heard of is taken to go on for so long: by 40 m/s^2 a hand strays from that by 8 mm."""
SPEED_OVER_S = 0.01
KEPT_S = 1.0


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


class DeviceWay:
    """Joins places by lines in time, for a held place would be a delay, and a spring to it would give energy.

    Places that are heard of together were sent at equal times since the last one before them; the newest of them is
    where the stylus is.
    """

    def __init__(self, now_s: float, place_m: Array) -> None:
        self._times_s, self._places_m = [now_s], [place_m]

    def heard(self, now_s: float, places_m: Sequence[Array]) -> None:
        """Add places (3,), the newest last."""
        last_s, times_s = self._times_s[-1], self._times_s
        for k, place_m in enumerate(places_m):
            times_s.append(last_s + (now_s - last_s) * (k + 1) / len(places_m))
            self._places_m.append(place_m)
        if times_s[0] < now_s - 2 * KEPT_S:
            old = sum(1 for time_s in times_s if time_s < now_s - KEPT_S)
            del times_s[:old], self._places_m[:old]

    def at(self, t_s: float) -> Array:
        """Return the position (3,) then; after the newest it moves on evenly, for PREDICTED_S at most."""
        after_s = min(t_s - self._times_s[-1], PREDICTED_S)
        if after_s <= 0 or len(self._times_s) == 1:
            return self._between(t_s)
        began_s = max(self._times_s[-1] - SPEED_OVER_S, self._times_s[0])
        newest_m = self._places_m[-1]
        speed_m_s = (newest_m - self._between(began_s)) / max(self._times_s[-1] - began_s, SPEED_OVER_S)
        return newest_m + speed_m_s * after_s

    def _between(self, t_s: float) -> Array:
        times_s, places_m = self._times_s, self._places_m
        later = len(times_s) - 1
        while later > 0 and times_s[later - 1] > t_s:
            later -= 1
        if later == 0:
            return places_m[0]
        share = (t_s - times_s[later - 1]) / max(times_s[later] - times_s[later - 1], 1e-9)
        return places_m[later - 1] + min(share, 1.0) * (places_m[later] - places_m[later - 1])
