"""Which tau to try next for the catch, from the signed misses of those tried."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

PLAUSIBLE_JUMP_M = 0.5
"""Neighbours whose signed misses differ by more do not enclose a catch: the ball came down in another way."""

NEIGHBOUR_STEPS = 4.0
"""Trials farther apart than this many steps of the grid tell nothing about what lies between them."""

EDGE_SHARE = 0.1
"""A bracket is never cut nearer to its ends than this share of it."""


@dataclass(frozen=True)
class Trial:
    """One rollout: ``signed_miss_m`` is None where the ball never came down through the rim's plane."""

    tau_scale: float
    signed_miss_m: float | None
    caught: bool


@dataclass(frozen=True)
class TauRange:
    """Where to look: from ``low`` to ``high``, first at ``start``, in steps of ``step``, down to ``resolution``."""

    low: float
    high: float
    start: float
    step: float
    resolution: float


def next_tau(trials: Sequence[Trial], where: TauRange) -> float | None:
    """The next tau_scale to try until one catches; None where nothing is left to try.

    Two trials whose misses have opposite signs enclose a catch: it is cut there by the secant. Otherwise the secant
    through the two newest neighbours is followed outwards, and the grid is visited from the start outwards.
    """
    if not trials:
        return where.start
    inside = bracket_tau(trials, where)
    if inside is not None:
        return inside
    if len(trials) >= 2:
        beyond = _beyond(trials[-2], trials[-1], where)
        if beyond is not None and _is_new(beyond, trials, where.step / 2):
            return beyond
    return next_grid_tau(trials, where)


def next_grid_tau(trials: Sequence[Trial], where: TauRange) -> float | None:
    """The grid point nearest to the start that no trial has come near yet, or None."""
    up = math.floor((where.high - where.start) / where.step + 1e-9)
    down = math.floor((where.start - where.low) / where.step + 1e-9)
    for k in range(1, max(up, down) + 1):
        for sign, most in ((1, up), (-1, down)):
            tau = where.start + sign * k * where.step
            if k <= most and _is_new(tau, trials, where.step / 2):
                return tau
    return None


def bracket_tau(trials: Sequence[Trial], where: TauRange) -> float | None:
    """A tau between two neighbours that enclose a catch and of which none is caught yet, or None."""
    ranked = sorted(trials, key=lambda trial: trial.tau_scale)
    best: tuple[float, float] | None = None
    for left, right in pairwise(ranked):
        tau = _between(left, right, where)
        if tau is None:
            continue
        miss = min(abs(left.signed_miss_m or 0.0), abs(right.signed_miss_m or 0.0))
        if best is None or miss < best[0]:
            best = (miss, tau)
    return None if best is None else best[1]


def catch_windows(trials: Sequence[Trial]) -> list[list[Trial]]:
    """Runs of neighbouring tau that all catch, widest run first."""
    windows: list[list[Trial]] = []
    joined = False
    for trial in sorted(trials, key=lambda trial: trial.tau_scale):
        if trial.caught and joined:
            windows[-1].append(trial)
        elif trial.caught:
            windows.append([trial])
        joined = trial.caught
    return sorted(windows, key=lambda window: window[0].tau_scale - window[-1].tau_scale)


def _between(left: Trial, right: Trial, where: TauRange) -> float | None:
    if left.signed_miss_m is None or right.signed_miss_m is None or left.caught or right.caught:
        return None
    gap = right.tau_scale - left.tau_scale
    opposite = left.signed_miss_m * right.signed_miss_m < 0
    jump = abs(left.signed_miss_m - right.signed_miss_m)
    if not opposite or jump > PLAUSIBLE_JUMP_M or not where.resolution < gap < NEIGHBOUR_STEPS * where.step:
        return None
    share = left.signed_miss_m / (left.signed_miss_m - right.signed_miss_m)
    return left.tau_scale + gap * min(max(share, EDGE_SHARE), 1 - EDGE_SHARE)


def _beyond(old: Trial, new: Trial, where: TauRange) -> float | None:
    if old.signed_miss_m is None or new.signed_miss_m is None or old.signed_miss_m == new.signed_miss_m:
        return None
    if abs(new.tau_scale - old.tau_scale) > NEIGHBOUR_STEPS * where.step:
        return None
    slope = (new.signed_miss_m - old.signed_miss_m) / (new.tau_scale - old.tau_scale)
    reach = max(-3 * where.step, min(3 * where.step, -new.signed_miss_m / slope))
    tau = new.tau_scale + reach
    return tau if where.low <= tau <= where.high else None


def _is_new(tau: float, trials: Sequence[Trial], apart: float) -> bool:
    return all(abs(trial.tau_scale - tau) >= apart * (1 - 1e-9) for trial in trials)
