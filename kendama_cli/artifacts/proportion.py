"""Interval of a counted rate, and the number of trials after which the rate is known."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

ERROR = 0.05
EARLY, LATE = 0.02, 0.03
"""Error of the interval where an evaluation ends early, and where it does not: ERROR in sum, whatever ended it."""
PART, FEWEST = 3, 5
"""An evaluation may end after a PART-th of its trials, but not after fewer than FEWEST."""


class Interval(NamedTuple):
    """A rate's 95 % interval."""

    low: float
    high: float


def success_interval(successes: float, n: int, error: float = ERROR) -> Interval:
    """Return the exact 1 - ``error`` interval of a proportion (Clopper and Pearson 1934); [0, 1] where n is 0."""
    from scipy.special import betaincinv  # noqa: PLC0415 - settings, which a run with nothing to do reads, import this

    low = float(betaincinv(successes, n - successes + 1, error / 2)) if successes > 0 else 0.0
    high = float(betaincinv(successes + 1, n - successes, 1 - error / 2)) if successes < n else 1.0
    return Interval(low, high)


@dataclass(frozen=True)
class Evaluation:
    """An evaluation in at most ``planned`` trials, which ends early where the rate is clear, unless ``thorough``.

    There is one look before the end, the first after a PART-th of the trials at which successes alone could end it.
    It ends there if the interval at 1 - EARLY is no wider than the 95 % interval of all trials at an even chance.
    An interval at 1 - EARLY there and at 1 - LATE at the end misses the rate with a probability of at most
    EARLY + LATE, whatever ends it (Bonferroni): so it holds too for a rate that is counted beside.
    """

    planned: int
    thorough: bool

    def to_play(self, successes: int, played: int) -> int:
        """Return the number of trials to the next look; 0 where the evaluation has ended."""
        if played < self._look:
            return self._look - played
        return 0 if played == self._look and self._is_narrow(successes, played) else self.planned - played

    def figures(self, name: str, successes: int, played: int) -> dict[str, float | None]:
        """Return the metrics of a rate: ``name``, and the ends of its 95 % interval; None where nothing was played."""
        if not played:
            return {name: None, f"{name}_low": None, f"{name}_high": None}
        error = ERROR if self._look == self.planned else EARLY if played < self.planned else LATE
        low, high = success_interval(successes, played, error)
        return {name: successes / played, f"{name}_low": low, f"{name}_high": high}

    @functools.cached_property
    def _look(self) -> int:
        """Number of trials after which the evaluation may end early."""
        looks = range(max(-(-self.planned // PART), FEWEST), self.planned)
        return self.planned if self.thorough else next((n for n in looks if self._is_narrow(n, n)), self.planned)

    def _is_narrow(self, successes: int, n: int) -> bool:
        (low, high), even = success_interval(successes, n, EARLY), success_interval(self.planned / 2, self.planned)
        return high - low <= even.high - even.low
