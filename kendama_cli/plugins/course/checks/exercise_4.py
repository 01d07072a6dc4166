"""Grades exercise 4: SARSA by hand, and its baseline."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kendama_cli.plugins.course.work import Work, WrongAnswerError, array_of, require, require_close

ROWS, COLUMNS, LARGEST_M_S2, HOLD_S = 324, 5, 8.0, 0.05


def row(work: Work) -> None:
    """Check every digit, at positions beside its edges."""
    own, rng = work.function("row"), np.random.default_rng(4)
    for _ in range(200):
        x, v, angle, rate = rng.uniform([-0.4, -2, -math.pi, -9], [0.4, 2, math.pi, 9])
        i, j = int(abs(x) >= 0.15), int(v >= -0.7) + int(v >= 0.7)
        k, m = math.floor(math.degrees(angle) / 20.0 + 0.5) % 18, int(rate >= -0.5) + int(rate >= 0.5)
        found = own(np.array([x, v, angle, rate, 2.0]))
        wanted = ((i * 3 + j) * 18 + k) * 3 + m
        if found != wanted:
            raise WrongAnswerError(
                f"row() gives {found} for x {x:.2f}, velocity {v:.2f}, angle {math.degrees(angle):.0f} degrees, rate "
                f"{rate:.1f}; expected {wanted}: the digits are i={i}, j={j}, k={k}, m={m}"
            )


def update(work: Work) -> None:
    """Check a short rollout with a repeated pair against the equations."""
    own, rng = work.function("update"), np.random.default_rng(5)
    q, e = rng.normal(0.0, 1.0, (ROWS, COLUMNS)), np.zeros((ROWS, COLUMNS))
    wanted_q, wanted_e = q.copy(), e.copy()
    alpha, gamma, lam = 0.5, 0.9, 0.8
    steps: list[tuple[int, int, float, int | None, int]] = [
        (3, 1, 0.0, 7, 2),
        (7, 2, -1.0, 3, 1),
        (3, 1, 0.5, 9, 0),
        (9, 0, 10.0, None, 0),
    ]
    for number, (s, a, r, s2, a2) in enumerate(steps, 1):
        delta = own(q, e, s, a, r, s2, a2, alpha, gamma, lam)
        wanted_e[s, a] = 1.0
        wanted = r - wanted_q[s, a] + (0.0 if s2 is None else gamma * wanted_q[s2, a2])
        wanted_q += alpha * wanted * wanted_e
        wanted_e *= gamma * lam
        where = f"after step {number}" + (", the last of a rollout" if s2 is None else "")
        hint = "delta = r + gamma Q[s2, a2] - Q[s, a]; without the second term where s2 is None"
        require_close(f"delta {where}", delta, wanted, 1e-9, hint)
        hint = "the trace of the visited pair is 1 (not one more) while Q is changed, and all traces fade afterwards"
        require_close(f"Q {where}", q, wanted_q, 1e-9, hint)
        require_close(f"e {where}", e, wanted_e, 1e-9, hint)


def harmonic(work: Work) -> None:
    """Check frequencies, amplitudes and signs of many samples."""
    own, rng = work.function("harmonic"), np.random.default_rng(6)
    t_s = np.arange(0.0, 12.0, 0.01)
    largest, paces, signs = [], [], set()
    for _ in range(60):
        wave = own(rng)
        require(callable(wave), "harmonic(rng) has to give a function of time, not a number: def or lambda")
        values = array_of("the harmonic", [wave(float(t)) for t in t_s], t_s.shape)
        require(abs(values[0]) < 1e-9, "a harmonic begins with 0 at t = 0: sign * A * sin(w t)")
        largest.append(float(np.abs(values).max()))
        signs.add(bool(values[2] > 0))
        paces.append(math.pi * float(np.count_nonzero(np.diff(np.sign(values[1:])) != 0)) / t_s[-1])
    require(
        min(largest) > 0.58 * LARGEST_M_S2 and max(largest) < 1.001 * LARGEST_M_S2,
        f"amplitudes from {min(largest):.2f} to {max(largest):.2f} m/s^2 were drawn; allowed: 4.8 to 8",
    )
    require(max(largest) - min(largest) > 1.0, "the amplitude is always the same: draw it for each harmonic")
    require(
        min(paces) > 2.6 and max(paces) < 8.4 and max(paces) - min(paces) > 2.0,
        f"frequencies from {min(paces):.1f} to {max(paces):.1f} rad/s were drawn; wanted: all of 3 to 8",
    )
    require(signs == {True, False}, "every harmonic begins to the same side: draw the sign too")


def learn(work: Work) -> None:
    """Check ties, and that the whole learns on seeds of ours."""
    own = work.function("greedy")
    for values, before, wanted in (
        ([0.0, 1.0, 3.0, 2.0, 0.0], 1, 2),
        ([5.0, 5.0, 5.0, 5.0, 5.0], 3, 3),
        ([1.0, 4.0, 0.0, 4.0, 2.0], 3, 3),
    ):
        found = own(np.array(values), before)
        require(found == wanted, f"greedy({values}, before={before}) is {found}; expected {wanted}")
    cap = work.number("CAP")
    needed = [work.function("learn")(seed)[0] for seed in (31, 32, 33)]
    require(
        float(np.median(needed)) < cap,
        f"on three seeds learning needed {needed} rollouts, {cap:g} being the cap: look at row, update and harmonic",
    )


def lucky(work: Work) -> None:
    """Check the count on rollouts whose outcome is arranged, then on real ones."""
    own = work.function("lucky")
    for pattern, wanted in (
        ("0010" + "1" * 10, None),
        ("001" + "1" * 10, 4),
        ("1" + "1" * 10, 2),
        ("1011" + "0" * 3, None),
    ):
        found = _arranged(own, pattern)
        expected = _counted(pattern, int(work.number("CAP"))) if wanted is None else wanted
        require(
            found == expected,
            f"lucky() gives {found} where rollouts end {pattern}... (1: success); expected {expected}: the first of "
            "ten successes in a row of a replayed harmonic, the one in which it was found not among them",
        )


def _arranged(own: Any, pattern: str) -> Any:
    """Return the result of ``own`` for rollouts that end as ``pattern`` says, and with success after it."""
    space = getattr(own, "__wrapped__", own)
    return _with_driven(space, iter(pattern))


def _with_driven(own: Any, ends: Any) -> Any:
    names = _globals(own)
    before = names["driven"]
    names["driven"] = lambda wanted, seed: next(ends, "1") == "1"
    try:
        return own(1)
    finally:
        names["driven"] = before


def _globals(own: Any) -> dict[str, Any]:
    """Return the names among which the student's function looks for ``driven``."""
    cell = next((one.cell_contents for one in own.__closure__ or () if callable(one.cell_contents)), own)
    names: dict[str, Any] = cell.__globals__
    require("driven" in names, "the cell that defines driven() is gone; lucky() plays its rollouts by it")
    return names


def _counted(pattern: str, cap: int) -> int:
    kept, streak = False, 0
    for rollout in range(1, cap + 1):
        success = (pattern[rollout - 1] if rollout <= len(pattern) else "1") == "1"
        if kept:
            streak = streak + 1 if success else 0
        if streak == 10:
            return rollout - 9
        kept = success
    return cap


def verdict(work: Work) -> None:
    """Check the interval of the student's own lists, and the conclusion that it allows."""
    table, null = (np.asarray(work.value(name), dtype=np.float64) for name in ("table_rollouts", "null_rollouts"))
    require(len(table) >= 5 and len(null) >= 5, "compare at least five seeds of each")
    rng = np.random.default_rng(7)
    drawn = [rng.choice(table, len(table)).mean() - rng.choice(null, len(null)).mean() for _ in range(4000)]
    low, high = np.percentile(drawn, [2.5, 97.5])
    hint = "percentiles 2.5 and 97.5 of mean(resampled table) - mean(resampled null)"
    require_close("interval", work.value("interval"), [low, high], 0.15 * (high - low) + 1e-9, hint)
    said = work.choice("verdict", "table", "null", "cannot tell")
    right = "table" if high < 0 else "null" if low > 0 else "cannot tell"
    near = min(abs(low), abs(high)) < 0.1 * (high - low)
    require(said == right or near, f"an interval from {low:.1f} to {high:.1f} says '{right}', not '{said}'")


CHECKS = {1: row, 2: update, 3: harmonic, 4: learn, 5: lucky, 6: verdict}
