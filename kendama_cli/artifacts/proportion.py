"""Interval of a counted rate."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.special import betaincinv


@dataclass(frozen=True)
class Interval:
    """A rate's 95 % interval."""

    low: float
    high: float


def success_interval(successes: float, n: int) -> Interval:
    """Return the exact 95 % interval of a proportion (Clopper and Pearson 1934); the whole of [0, 1] where n is 0."""
    low = float(betaincinv(successes, n - successes + 1, 0.025)) if successes > 0 else 0.0
    high = float(betaincinv(successes + 1, n - successes, 0.975)) if successes < n else 1.0
    return Interval(low, high)
