"""Declaration of a catch."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kendama_cli.control.catch_game import HELD_S, MIN_SAMPLES, Game, catch_outcome, find_crossing, held
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


@pytest.mark.parametrize(("before", "fitted"), [(MIN_SAMPLES + 1, True), (MIN_SAMPLES, False), (60, True), (5, False)])
def test_a_fall_through_the_rims_plane_is_that_of_numpys_parabola_or_of_a_straight_line(
    before: int, fitted: bool
) -> None:
    """A noisy flight of ``before`` samples over the plane, from ``free_s`` on; a fall before that does not count."""
    rng, h, height = np.random.default_rng(10012), 0.004, 1.2
    t = 3.0 + h * np.arange(90)
    s = t - t[before - 1] - 0.4 * h
    path = np.column_stack([t, 0.2 + 0.5 * s, -0.1 - 0.2 * s, height - 2.5 * s - 4.9 * s**2])
    path[:, 1:] += rng.normal(0.0, 1e-5, (90, 3))
    bounce = [[2.0, 0, 0, height + 0.1], [2.1, 0, 0, height - 0.1]]
    found = find_crossing(np.vstack((bounce, path)), height, 3.0)
    assert found is not None
    if fitted:
        curves = np.polyfit(t[:before], path[:before, 1:], 2).T
        late = max(np.roots(curves[2] - [0.0, 0.0, height]).real)
        wanted = [late, *(np.polyval(curve, late) for curve in curves)]
    else:
        part = (path[before - 1, 3] - height) / (path[before - 1, 3] - path[before, 3])
        wanted = path[before - 1] + part * (path[before] - path[before - 1])
    assert [found.t_s, *found.position_m] == pytest.approx(wanted, abs=1e-9)
    assert find_crossing(path, height, 3.5) is None


def test_a_prediction_is_held_against_the_crossing_at_its_horizon() -> None:
    """Seen 0.30, 0.20 and 0.10 s before the catch that each tells, 30, 20 and 10 mm beside the real one."""
    rims = [SimpleNamespace(t_s=2.0, position_m=np.array([1.0 + 0.1 * left, 0.5, left])) for left in (0.3, 0.2, 0.1)]
    told: Any = [SimpleNamespace(t_s=2.0 - left, rim=rim) for left, rim in zip((0.3, 0.2, 0.1), rims, strict=True)]
    crossing: Any = SimpleNamespace(t_s=2.0, position_m=np.array([1.0, 0.5, 9.0]))
    swing: Any = SimpleNamespace(outcome="goal")
    game = Game(swing, (), tuple(told), None, SimpleNamespace(problems=["blind"]), crossing)  # type: ignore[arg-type]
    for horizon_s, error_m in ((0.05, 0.01), (0.15, 0.02), (0.25, 0.03), (0.9, 0.03)):
        assert game.prediction_error_m(horizon_s) == pytest.approx(error_m)
    assert game.swung_up
    assert game.outcome == "not swung up; blind"
    assert Game(swing, (), (), None, game.observed, crossing).prediction_error_m(0.1) is None
