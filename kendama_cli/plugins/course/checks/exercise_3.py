"""Grades exercise 3: windows of tau, and which of them lasts."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from kendama_cli.api import play, swing
from kendama_cli.plugins.course.work import Work, WrongAnswerError, array_of, require, require_close

TRIES, SEEDS = 12, 30
LEAST_SHARE = 0.75
"""The first window's middle catches in about 0.8 of these worlds, the best places of the second in 0.9 to 1."""


def miss_m(work: Work) -> None:
    """Check that the miss is the library's, at two taus."""
    plan = work.value("plan")
    for tau in (0.965, 1.145):
        t_s = np.arange(0.0, tau * plan.duration_s, 0.002)
        wanted = swing(t_s, play(dataclasses.replace(plan, tau_scale=tau), t_s).position_m).miss_m
        hint = "replace tau_scale, play at np.arange(0, tau * plan.duration_s, 0.002), carry the cup, take miss_m [m]"
        require_close(f"miss_m({tau})", work.function("miss_m")(tau), wanted, 0.003, hint)


def windows(work: Work) -> None:
    """Check on curves whose windows are known."""
    own = work.function("windows")
    taus = np.linspace(0.8, 1.2, 21)
    for misses, wanted in (
        (0.5 * (taus - 1.0), [(0.96, 1.04)]),
        (np.abs(taus - 1.0) - 0.1, [(0.88, 0.92), (1.08, 1.12)]),
        (0.05 * (taus - 0.8), [(0.8, 1.2)]),
        (0.0 * taus + 0.5, []),
    ):
        found = own(taus, misses, 0.02)
        require(
            isinstance(found, list) and len(found) == len(wanted),
            f"windows() gives {found!r} for a curve with {len(wanted)} windows; give a list of pairs (low, high)",
        )
        for pair, edges in zip(found, wanted, strict=True):
            hint = "join the samples by straight lines: an edge lies where |miss| is just half_width_m, between samples"
            require_close("a window", pair, edges, 0.001, hint)


def search(work: Work) -> None:
    """Check for few calls, none repeated, and a zero in the end."""
    own = work.function("search")
    for shift in (0.0, 0.013):
        asked: list[float] = []

        def miss(tau: float, shift: float = shift, asked: list[float] = asked) -> float:
            asked.append(float(tau))
            require(len(asked) < 40, "search() calls miss() without end; stop where |miss| <= enough_m")
            return float(0.9 * (tau - 1.0 - shift) - 1.5 * (tau - 1.0 - shift) ** 2)

        tau, calls = array_of("search(...)", own(miss, 0.90, 0.93, 1e-4), (2,))
        require(
            abs(miss(float(tau))) <= 1e-4, f"search() ends at {tau:.4f}, where the miss is still more than enough_m"
        )
        asked.pop()
        require(len(asked) == len(set(asked)), "search() calls miss() twice with the same tau: keep the values")
        require_close("the number of calls", calls, len(asked), 0.1, "count every call of miss()")
        require(len(asked) <= 8, f"search() needs {len(asked)} rollouts; the secant method needs at most 8 here")


def robust(work: Work) -> None:
    """Check the student's tau, in perturbed simulations that they have not tried."""
    tau, tried = work.number("robust_tau"), work.function("tried")
    own = float(np.mean([bool(tried(tau, seed)) for seed in range(SEEDS)]))
    hint = f"the mean of tried(robust_tau, seed) over the seeds 0 to {SEEDS - 1}"
    require_close("success_share", work.number("success_share"), own, 1e-6, hint)
    fresh = float(np.mean([bool(tried(tau, seed)) for seed in range(700_000, 700_000 + TRIES)]))
    both = (own * SEEDS + fresh * TRIES) / (SEEDS + TRIES)
    if both <= LEAST_SHARE:
        raise WrongAnswerError(
            f"tau {tau:.3f} catches in {both:.2f} of {SEEDS + TRIES} worlds, {TRIES} of them fresh; there is one that "
            "catches in more than 0.85: look in the other window"
        )
    require(both > 0.85, f"tau {tau:.3f} catches in {both:.2f} of the worlds; more than 0.85 is possible")


def wilson(work: Work) -> None:
    """Check against the formula, and on the cases in which a normal interval fails."""
    for k, n in ((30, 30), (0, 10), (7, 12)):
        z2, p = 1.96**2, k / n
        half = 1.96 * math.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        wanted = [(p + z2 / (2 * n) + sign * half) / (1 + z2 / n) for sign in (-1, 1)]
        hint = "(p + z^2 / 2n -+ z sqrt(p (1 - p) / n + z^2 / 4n^2)) / (1 + z^2 / n), z = 1.96"
        require_close(f"wilson({k}, {n})", work.function("wilson")(k, n), wanted, 0.002, hint)


CHECKS = {1: miss_m, 2: windows, 3: search, 4: robust, 5: wilson}
