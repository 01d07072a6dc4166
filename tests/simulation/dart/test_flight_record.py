"""Record of the ball's flight while a motion plays, on a ball whose tension is told."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.rollout import FlightRecord
from kendama_cli.simulation.dart.stepper import STEP_S
from tests.shipped_conf import plain

GAME = build(GameSettings, plain("game", "kendama"), "game")


def _slack_s(taut: list[bool]) -> float:
    ball: Any = SimpleNamespace(
        game=GAME, position_m=np.array([0.0, 0.0, -0.4]), tie_m=np.zeros(3), axis=np.array([0.0, 0.0, 1.0])
    )
    seen = FlightRecord(ball)
    t_s = 0.0
    for pulls in taut:
        t_s += STEP_S
        ball.tension_n = float(pulls)
        seen.observe(t_s)
    return seen.swing_slack_s


def test_a_rope_that_is_always_taut_was_slack_for_no_time_at_all() -> None:
    assert _slack_s([True] * 2000) == 0.0


def test_the_longest_time_for_which_the_rope_was_slack_is_told_in_whole_steps() -> None:
    assert _slack_s([True] * 500 + [False] * 7 + [True] * 3 + [False] * 30 + [True]) == 30 * STEP_S
    assert _slack_s([True] * 3 + [False] * 30) == 0.0, "the flight's own slack is none of the swing's"


G = 9.81


def _played(rows: list[tuple[float, float, bool]], *, from_s: float = 0.0, in_cup: bool = True) -> FlightRecord:
    """Places x and height of the ball over the tie of a cup at rest, and whether the rope is taut, at every step."""
    axis = np.array([0.0, 0.0, 1.0])
    ball: Any = SimpleNamespace(game=GAME, tie_m=np.zeros(3), axis=axis, is_in_cup=lambda: in_cup)
    seen = FlightRecord(ball, from_s)
    for k, (x, z, taut) in enumerate(rows):
        ball.position_m, ball.tension_n = np.array([x, 0.0, z]), float(taut)
        seen.observe((k + 1) * STEP_S)
    return seen


def _thrown(x: float, x_m_s: float, taut: bool, *, until: float = -0.3) -> list[tuple[float, float, bool]]:
    """A ball that rises at 2 m/s from half a metre over the tie and falls."""
    t = np.arange(0.0, 1.2, STEP_S)
    z = 0.5 + 2.0 * t - G / 2 * t**2
    return [(x + x_m_s * float(s), float(h), taut) for s, h in zip(t, z, strict=True) if h > until]


def test_a_fall_on_a_taut_rope_is_no_descent() -> None:
    """A swing-up goes over the rim on the taut rope and comes back 392 mm beside it; the ball is caught later."""
    seen = _played([*_thrown(0.392, 0.0, taut=True), *_thrown(-0.0014, 0.0, taut=False, until=0.02)])
    assert seen.miss_m == pytest.approx((-0.0014, 0.0))
    assert seen.caught


def test_what_comes_into_the_cup_on_its_second_flight_is_not_caught() -> None:
    first, low = _thrown(0.35, 0.0, taut=False), [(0.3, -0.3, True)] * 20
    seen = _played([*first, *low, *_thrown(0.0, 0.0, taut=False, until=0.02)])
    assert seen.miss_m == pytest.approx((0.35, 0.0))
    assert not seen.caught


def test_a_descent_before_the_planned_catch_is_none_of_it() -> None:
    first, low = _thrown(0.35, 0.0, taut=False), [(0.3, -0.3, True)] * 20
    seen = _played([*first, *low, *_thrown(0.0, 0.0, taut=False, until=0.02)], from_s=len(first) * STEP_S)
    assert seen.miss_m == pytest.approx((0.0, 0.0))
    assert seen.caught
    assert seen.swing_slack_s == pytest.approx(len(first) * STEP_S)
    early = _played(_thrown(0.01, 0.0, taut=False, until=0.02), from_s=9.0)
    assert early.caught, "a catch that comes before it all is still the last descent of the swing"


def test_the_miss_is_where_a_ball_in_free_fall_reaches_the_rim() -> None:
    """Carried on straight from one radius above the rim: of its own fall in 8 ms the parabola adds 0.1 mm."""
    rows = _thrown(-0.2, 0.3, taut=False)
    falls_s = (2.0 + np.sqrt(4.0 + 2 * G * (0.5 - GAME.cup.rim_m))) / G
    seen = _played(rows)
    assert seen.miss_m is not None
    assert seen.miss_m[0] == pytest.approx(-0.2 + 0.3 * falls_s, abs=2e-4)
    assert not _played(rows, in_cup=False).caught
