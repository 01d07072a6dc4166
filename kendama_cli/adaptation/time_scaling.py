"""Search over tau: the next to try and the windows that catch, from the signed misses of those tried."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import Akima1DInterpolator

PLAUSIBLE_JUMP_M = 0.5
"""Neighbours whose signed misses differ by more do not enclose a catch: the ball came down in another way."""

NEIGHBOUR_STEPS = 4.0
"""Trials farther apart than this many steps of the grid tell nothing about what lies between them."""

EDGE_FRACTION = 0.1
"""A bracket is never cut nearer to its ends than this fraction of it."""

CENTRED_M = 0.006
"""A window with a trial whose miss is below this is centred well enough."""

MAX_IN_WINDOW = 4
"""A stretch with so many trials in it is left as it is."""


@dataclass(frozen=True)
class TauTrial:
    """One rollout: ``signed_miss_m`` is None where the ball never came down through the rim's plane."""

    tau_scale: float
    signed_miss_m: float | None
    caught: bool


@dataclass(frozen=True)
class TauRange:
    """Range of tau: from ``low`` to ``high``, first at ``start``, in steps of ``step``, down to ``resolution``."""

    low: float
    high: float
    start: float
    step: float
    resolution: float


def next_tau(trials: Sequence[TauTrial], where: TauRange) -> float | None:
    """Return the next tau_scale to try until one catches; None if nothing is left to try.

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


def next_grid_tau(trials: Sequence[TauTrial], where: TauRange) -> float | None:
    """Return the grid point nearest to the start that no trial has come near yet, or None."""
    up = math.floor((where.high - where.start) / where.step + 1e-9)
    down = math.floor((where.start - where.low) / where.step + 1e-9)
    for k in range(1, max(up, down) + 1):
        for sign, maximum in ((1, up), (-1, down)):
            tau = where.start + sign * k * where.step
            if k <= maximum and _is_new(tau, trials, where.step / 2):
                return tau
    return None


def bracket_tau(trials: Sequence[TauTrial], where: TauRange) -> float | None:
    """Return a tau between two neighbours that enclose a catch and of which none is caught yet, or None."""
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


@dataclass(frozen=True)
class Window:
    """Stretch of tau that should catch, from ``low`` to ``high``; ``best`` is its trial nearest the centre."""

    low: float
    high: float
    best: TauTrial


def catch_windows(trials: Sequence[TauTrial], where: TauRange, mouth_m: float) -> tuple[Window, ...]:
    """Return the windows found so far, widest first: stretches with a catch where |miss| is below ``mouth_m``."""
    windows = []
    for low, high, _ in _promising(trials, where, mouth_m):
        inside = [trial for trial in trials if trial.caught and low <= trial.tau_scale <= high]
        if inside:
            windows.append(Window(low, high, min(inside, key=_distance_m)))
    return tuple(sorted(windows, key=lambda window: (window.low - window.high, window.low)))


def next_window_tau(trials: Sequence[TauTrial], where: TauRange, mouth_m: float) -> float | None:
    """Return the next tau by which all windows become known, each with a trial in its centre; None at the end.

    First the centre of every promising stretch, as the curve through the misses predicts it; then the grid.
    """
    for low, high, center in _promising(trials, where, mouth_m):
        inside = [trial for trial in trials if low - where.resolution <= trial.tau_scale <= high + where.resolution]
        known = any(
            _distance_m(trial) < CENTRED_M or abs(trial.tau_scale - center) < where.resolution for trial in inside
        )
        if not known and len(inside) < MAX_IN_WINDOW and high - low >= where.resolution:
            return center
    return next_grid_tau(trials, where)


def _promising(trials: Sequence[TauTrial], where: TauRange, mouth_m: float) -> list[tuple[float, float, float]]:
    """Return stretches (low, high, centre) where the curve through the misses stays within ``mouth_m`` of zero."""
    ranked = sorted(trials, key=lambda trial: trial.tau_scale)
    count = max(round(2 * (where.high - where.low) / where.resolution), 1) + 1
    tau = np.linspace(where.low, where.high, count)
    miss = np.full(count, np.inf)
    for run in _smooth_runs(ranked, where):
        known = np.array([trial.tau_scale for trial in run])
        inside = (tau >= known[0]) & (tau <= known[-1])
        values = np.array([trial.signed_miss_m for trial in run], dtype=np.float64)
        if len(run) > 2:
            miss[inside] = Akima1DInterpolator(known, values, method="makima")(tau[inside])
        else:
            miss[inside] = np.interp(tau[inside], known, values)
    hopeful = np.abs(miss) < mouth_m
    for trial in ranked:
        nearest = int(np.abs(tau - trial.tau_scale).argmin())
        miss[nearest] = np.inf if trial.signed_miss_m is None else trial.signed_miss_m
        hopeful[nearest] = trial.caught
    edges = np.flatnonzero(np.diff(np.concatenate([[False], hopeful, [False]]).astype(int)))
    found: list[tuple[int, int]] = []
    lost = np.array([trial.tau_scale for trial in ranked if not trial.caught])
    for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if found and not ((lost > tau[found[-1][1] - 1]) & (lost < tau[first])).any():
            found[-1] = (found[-1][0], after)  # no miss was seen between the two: one stretch
        else:
            found.append((first, after))
    return [(float(tau[a]), float(tau[b - 1]), float(tau[a + int(np.abs(miss[a:b]).argmin())])) for a, b in found]


def _smooth_runs(ranked: Sequence[TauTrial], where: TauRange) -> list[list[TauTrial]]:
    """Return runs of neighbours that came down in the same way: near each other, and without a jump of the miss."""
    runs: list[list[TauTrial]] = []
    for trial in ranked:
        if trial.signed_miss_m is None:
            runs.append([])
            continue
        last = runs[-1][-1] if runs and runs[-1] else None
        if (
            last is None
            or last.signed_miss_m is None
            or abs(last.signed_miss_m - trial.signed_miss_m) > PLAUSIBLE_JUMP_M
            or trial.tau_scale - last.tau_scale > NEIGHBOUR_STEPS * where.step
        ):
            runs.append([])
        runs[-1].append(trial)
    return [run for run in runs if len(run) > 1]


def _distance_m(trial: TauTrial) -> float:
    return math.inf if trial.signed_miss_m is None else abs(trial.signed_miss_m)


def _between(left: TauTrial, right: TauTrial, where: TauRange) -> float | None:
    if left.signed_miss_m is None or right.signed_miss_m is None or left.caught or right.caught:
        return None
    gap = right.tau_scale - left.tau_scale
    opposite = left.signed_miss_m * right.signed_miss_m < 0
    jump = abs(left.signed_miss_m - right.signed_miss_m)
    if not opposite or jump > PLAUSIBLE_JUMP_M or not where.resolution < gap < NEIGHBOUR_STEPS * where.step:
        return None
    fraction = left.signed_miss_m / (left.signed_miss_m - right.signed_miss_m)
    return left.tau_scale + gap * min(max(fraction, EDGE_FRACTION), 1 - EDGE_FRACTION)


def _beyond(old: TauTrial, new: TauTrial, where: TauRange) -> float | None:
    if old.signed_miss_m is None or new.signed_miss_m is None or old.signed_miss_m == new.signed_miss_m:
        return None
    if abs(new.tau_scale - old.tau_scale) > NEIGHBOUR_STEPS * where.step:
        return None
    slope = (new.signed_miss_m - old.signed_miss_m) / (new.tau_scale - old.tau_scale)
    reach = max(-3 * where.step, min(3 * where.step, -new.signed_miss_m / slope))
    tau = new.tau_scale + reach
    return tau if where.low <= tau <= where.high else None


def _is_new(tau: float, trials: Sequence[TauTrial], spacing: float) -> bool:
    return all(abs(trial.tau_scale - tau) >= spacing * (1 - 1e-9) for trial in trials)
