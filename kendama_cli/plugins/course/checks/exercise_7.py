"""Grades exercise 7: the second half of the game, and what breaks it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

from kendama_cli.plugins.course.work import Work, WrongAnswerError, array_of, require, require_close

GRAVITY_M_S2 = 9.81
FRESH = range(900_000, 900_030)
LEAST_SHARE = 0.75
"""The law of the exercise catches 0.9 of these with perfect eyes, a cup that stands still 0.3."""


def landing(work: Work) -> None:
    """Check exact flights, a flight that stays below the rim, and too few readings."""
    rim, own = work.number("RIM_M"), work.function("landing")
    for x0, vx, z0, vz in ((-0.3, 1.1, 0.25, 0.6), (0.2, -0.4, 0.3, -0.2)):
        t = 0.04 + 0.02 * np.arange(6)
        seen = np.column_stack([t, x0 + vx * t, z0 + vz * t - 0.5 * GRAVITY_M_S2 * t**2])
        down = (vz + math.sqrt(vz**2 + 2 * GRAVITY_M_S2 * (z0 - rim))) / GRAVITY_M_S2
        hint = "fit lines to x and to z + g t^2 / 2 over the readings' own times; then the later crossing of RIM_M"
        require_close("landing(seen)", own(seen), [down, x0 + vx * down], 1e-6, hint)
    plain = work.value("landing")
    low = np.column_stack([t, 0 * t, -0.3 - 0.5 * GRAVITY_M_S2 * t**2])
    for what, seen in (("one reading", low[:1]), ("no reading", low[:0]), ("a flight below the rim", low)):
        try:
            found = plain(seen)
        except Exception as error:
            raise WrongAnswerError(f"landing() of {what} raised {type(error).__name__}: {error}; give None") from error
        require(found is None, f"landing() of {what} is {found}; give None")


def meet(work: Work) -> None:
    """Check that the cup arrives."""
    own = work.function("meet")
    for x, v, target, left in ((0.0, 0.0, 0.1, 0.3), (-0.1, 0.7, 0.05, 0.2)):
        a = float(own(x, v, target, left))
        hint = "a = 2 (target - x - v T) / T^2 brings it there"
        require_close("where meet() brings the cup", x + v * left + 0.5 * a * left**2, target, 1e-9, hint)
    require(
        math.isfinite(float(own(0.0, 0.5, 0.1, 0.0))), "meet() with no time left has to stay finite: at least 0.02 s"
    )


def act(work: Work) -> None:
    """Check that it catches balls that nobody has tried."""
    found = work.function("share")(work.function("act"), seeds=FRESH)
    require(
        found >= LEAST_SHARE,
        f"act() catches {found:.2f} of 30 fresh balls, a cup that stands still 0.3; 0.9 is possible: go to the "
        "landing's x, in the time from now (t_s) to the landing's t",
    )


def _same_shares(work: Work, name: str, law: str, conditions: list[dict[str, Any]]) -> list[float]:
    found = array_of(f"'{name}'", work.value(name), (len(conditions),))
    for place, how in enumerate(conditions):
        real = work.function("share")(work.function(law), **how)
        hint = f"share({law}, {', '.join(f'{key}={value}' for key, value in how.items())}) over the seeds 0 to 29"
        require_close(f"{name}[{place}]", found[place], real, 1e-6, hint)
    return [float(value) for value in found]


def noise(work: Work) -> None:
    """Check that the fractions are the same, and that hasty is worse where it matters."""
    levels = [{"noise_m": value} for value in work.value("NOISE_M")]
    patient, hasty = (
        _same_shares(work, f"{law}_shares", own, levels) for law, own in (("patient", "act"), ("hasty", "hasty"))
    )
    require(
        hasty[3] < patient[3] - 0.1,
        f"with 10 mm of noise hasty() catches {hasty[3]:.2f} and act() {patient[3]:.2f}; three readings are far "
        "worse: let hasty() see seen[-3:] only",
    )


def latency(work: Work) -> None:
    """Check that the fractions are the same, and that time stamps are worth something."""
    levels = [{"late": value} for value in work.value("LATE_STEPS")]
    honest, naive = (
        _same_shares(work, f"{law}_shares", own, levels) for law, own in (("honest", "act"), ("naive", "naive"))
    )
    require(naive[0] == honest[0], "without latency naive() and act() are the same, and have to catch the same balls")
    require(
        sum(naive[2:]) < sum(honest[2:]) - 0.2,
        "naive() catches as much as act() although readings are late: let it count left_s from the last reading's time",
    )


def weakest(work: Work) -> None:
    """Check that the fractions are the same, and their minimum."""
    ways, broken = work.value("WAYS"), work.value("broken")
    if not isinstance(broken, dict) or set(broken) != set(ways):
        raise WrongAnswerError(f"'broken' has to be a dictionary with the keys {', '.join(ways)}")
    for name, how in ways.items():
        real = work.function("share")(work.function("act"), **how)
        require_close(f"broken[{name!r}]", broken[name], real, 1e-6, "share(act, **WAYS[name]) over the seeds 0 to 29")
    said = work.choice("weakest", *ways)
    least = min(broken.values())
    require(broken[said] == least, f"'{said}' leaves {broken[said]:.2f}; there is one that leaves {least:.2f}")


def known_since(work: Work) -> None:
    """Check on estimates whose answer is known."""
    own = work.function("known_since")
    games = pd.DataFrame(
        {"index": [0, 1], "crossing_s": [2.0, 9.0], "crossing_m": [[0.10, 0.0, 1.3], [-0.2, 0.0, 1.3]]}
    )
    rows = [(0, 1.5, 0.20), (0, 1.6, 0.105), (0, 1.7, 0.13), (0, 1.8, 0.108), (0, 1.9, 0.101), (0, 2.1, 0.5)]
    rows += [(1, 8.5, -0.2), (1, 8.7, -0.203), (1, 8.9, -0.26)]
    estimates = pd.DataFrame(rows, columns=["game", "t_s", "x_m"])
    for index, within, wanted in ((0, 0.010, 0.2), (0, 0.002, 0.1), (0, 0.5, 0.5), (1, 0.010, 0.0)):
        hint = "the first estimate after the last one that is off, of this game and until its crossing"
        found = own(games, estimates, index, within)
        require_close(f"known_since(..., {index}, {within})", found, wanted, 1e-6, hint)


CHECKS = {1: landing, 2: meet, 3: act, 4: noise, 5: latency, 6: weakest, 7: known_since}
