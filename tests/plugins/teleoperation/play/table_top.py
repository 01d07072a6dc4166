"""A table for tests: the shipped game and settings, a hand that swings as a bundled demonstration, and what is kept."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np

from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.settings import PlaySettings
from kendama_cli.plugins.teleoperation.play.table import HandSample, PlayTable
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from tests.shipped_conf import CONF, plain

GAME = build(GameSettings, plain("game", "kendama"))
SETTINGS = build(PlaySettings, plain("play", "browser"))
DEMONSTRATION = CONF.parent / "data" / "demonstrations" / "swing-04.csv"


def swing() -> tuple[Array, Array]:
    """Times (n,) and places (n, 2), aside and up, of a bundled demonstration."""
    rows = np.loadtxt(DEMONSTRATION, delimiter=",", skiprows=3)
    return rows[:, 0], rows[:, (1, 3)] - rows[0, (1, 3)]


def hand(scale: float = 1.0, rate_hz: float = 125.0, wait_s: float = 0.6, lengths: float = 1.0) -> list[HandSample]:
    """The swing in ``scale`` times its time, at the rate of a mouse, and a wait at its end."""
    t_s, places = swing()
    times = np.arange(0.0, t_s[-1] * scale + wait_s, 1 / rate_hz)
    aside, up = (lengths * np.interp(times / scale, t_s, column) for column in places.T)
    return [HandSample(5.0 + t, x, z, 0.0) for t, x, z in zip(times.tolist(), aside.tolist(), up.tolist(), strict=True)]


class Kept(list[tuple[str, Conditions, Array]]):
    """Tries that the table stored."""

    reasons: tuple[str, ...] = ()

    def __call__(self, outcome: str, conditions: Conditions, samples: Array, reason: str) -> None:
        self.append((outcome, conditions, samples))
        self.reasons += (reason,)


def table(**changed: Any) -> tuple[PlayTable, Kept]:
    """A table with these settings changed, and what it keeps."""
    kept = Kept()
    return PlayTable(GAME, dataclasses.replace(SETTINGS, **changed), kept), kept


def drag(at: PlayTable, samples: list[HandSample], several: int = 1, clock_s: float | None = None) -> None:
    """Say the samples, so many in a message, as they happen or at one time."""
    for k in range(0, len(samples), several):
        part = samples[k : k + several]
        at.hand(part, held=True, now_s=part[-1].t_s if clock_s is None else clock_s)


@functools.cache
def caught_swing() -> tuple[float, Array]:
    """A time scale at which the bundled swing catches, and what is kept of it."""
    for scale in (0.98, 1.0, 0.99, 1.01, 0.92, 1.12):
        at, kept = table()
        drag(at, hand(scale))
        if kept and kept[0][0] == "caught":
            return scale, kept[0][2]
    raise AssertionError("no scale of the bundled swing catches on the table")
