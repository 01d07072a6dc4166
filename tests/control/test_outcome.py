"""Declaration of a catch."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.control.catch_game import HELD_S, catch_outcome, held
from kendama_cli.control.cup_cart import CartStep
from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState
from kendama_cli.learning.state import SwingState
from tests.simulation.dart.bench_robot import kendama_game

GAME = kendama_game()
ALONG = np.array([1.0, 0.0, 0.0])


def steps(
    sensor: str, blow_n: float = 0.0, at: int = 5, ball_m: np.ndarray | None = None, tilt_rad: float = 0.0
) -> list[CartStep]:
    """One step for each character, 0.02 s apart: x where the ball is in the cup; a blow in the step ``at``."""
    made = []
    zero = np.zeros(1)
    for k, sign in enumerate(sensor):
        wrench = np.array([0.0, 0.0, -3.0 - (blow_n if k == at else 0.0), 0.0, 0.0, 0.0])
        state = RobotState(
            zero, zero, zero, wrench, np.zeros(3), np.zeros(3) if ball_m is None else ball_m[k], sign == "x"
        )
        exchange = Exchange(JointCommand(zero, zero, zero), state, 0.02 * k)
        made.append(CartStep(0.02 * k, SwingState(0, 0, 0, 0), 0.0, exchange, tilt_rad))
    return made


@pytest.mark.parametrize(
    ("sensor", "blow_n", "words", "since_s"),
    [
        ("....xxxxxxxx", 20.0, "caught", 0.08),
        ("....xx.xxxxx", 20.0, "caught", 0.14),
        ("....xx......", 20.0, "struck the cup and left", 0.12),
        ("............", 0.5, "passed by", 0.0),
    ],
)
def test_the_final_reading_of_the_ball_sensor_counts(sensor: str, blow_n: float, words: str, since_s: float) -> None:
    outcome = catch_outcome(steps(sensor, blow_n), 0.1, ALONG, GAME, 0.0)
    assert outcome.words == words
    assert outcome.caught == (words == "caught")
    assert outcome.since_s == pytest.approx(since_s)
    assert outcome.blow_n == pytest.approx(blow_n)


def test_a_blow_long_after_the_catch_is_not_the_balls() -> None:
    assert catch_outcome(steps("." * 30, 20.0, at=25), 0.1, ALONG, GAME, 0.0).blow_n == 0.0


def test_a_ball_is_held_once_it_could_not_bounce_out_again() -> None:
    needed = round(HELD_S / 0.02)
    assert not held(steps("." + "x" * needed))
    assert held(steps("." + "x" * (needed + 2)))
    assert not held(steps("x" * 30 + "."))
    assert not held([])


@pytest.mark.parametrize(("beside_m", "words"), [(0.03, "caught"), (0.2, "in the cup, but not by the planned catch")])
@pytest.mark.parametrize("tilt_rad", [0.0, 0.35])
def test_a_ball_that_first_comes_down_beside_the_cup_is_not_caught(
    beside_m: float, words: str, tilt_rad: float
) -> None:
    """It falls along the axis of a cup that leans by 20 degrees: over the tie it is 24 mm further along."""
    t_s = 0.02 * np.arange(40)
    height = 0.3 - 1.2 * t_s
    across, axis = np.array([np.cos(tilt_rad), 0, -np.sin(tilt_rad)]), np.array([np.sin(tilt_rad), 0, np.cos(tilt_rad)])
    ball = beside_m * across + np.maximum(height, 0.02)[:, None] * axis
    outcome = catch_outcome(steps("." * 20 + "x" * 20, ball_m=ball, tilt_rad=tilt_rad), 0.2, ALONG, GAME, 0.0)
    assert outcome.in_cup
    assert outcome.words == words
