"""What is seen of the ball while a motion plays, on a ball whose pull is told."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.flight_record import FlightRecord
from kendama_cli.simulation.dart.world_pair import STEP_S
from tests.shipped_conf import plain

GAME = build(GameSettings, plain("game", "kendama"), "game")


def _slack_s(taut: list[bool]) -> float:
    ball: Any = SimpleNamespace(game=GAME, position_m=np.array([0.0, 0.0, -0.4]), tie_m=np.zeros(3))
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
