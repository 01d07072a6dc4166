"""The end of a swing-up: the ball is released when its rope is slack, and caught when it falls into the mouth."""

from __future__ import annotations

import math

import pytest

from kendama_cli.learning.reward import Flight, Goal
from kendama_cli.learning.state import SwingState
from kendama_cli.simulation.swingup.engine import mouth_m
from kendama_cli.simulation.swingup.environment import Release, fly
from kendama_cli.simulation.swingup.frozen_rollouts import random_success_rate
from kendama_cli.simulation.swingup.rail import CompiledRail
from kendama_cli.simulation.swingup.rollout import Catch
from tests.learning.settings_files import game_settings, learn_settings

GAME = game_settings()
HARD = learn_settings("hard")
RIM_M = GAME.cup.rim_m


def thrown(across_m: float, above_m: float, across_m_s: float, above_m_s: float, **replaced: object) -> Catch:
    """The flight of a ball with a slack rope that is thrown so beside a resting cup."""
    settings, swing = learn_settings("hard", **replaced), CompiledRail(GAME, 0.002)
    swing.numbers[:] = (0.0, across_m, above_m, 0.0, across_m_s, above_m_s, 0.0, 0.0)
    swing.read()
    return fly(swing, settings, GAME, 0.0, None)


def test_a_ball_thrown_straight_up_over_the_cup_is_caught_where_it_falls() -> None:
    catch = thrown(0.0, RIM_M + 0.01, 0.0, 0.8)
    assert catch.caught
    assert catch.miss_m < 1e-3
    # up and down again by 10 mm more: t = (v + sqrt(v^2 + 2 g h)) / g, air and time steps aside
    assert catch.duration_s == pytest.approx((0.8 + math.sqrt(0.64 + 2 * 9.81 * 0.01)) / 9.81, abs=0.006)


def test_the_cup_goes_to_meet_the_ball_as_far_as_its_own_limits_allow() -> None:
    near, far = (
        thrown(0.07, RIM_M + 0.02, 0.1, 1.0),
        thrown(0.07, RIM_M + 0.02, 0.1, 1.0, goal__catch_acceleration_m_s2=0.5),
    )
    assert near.caught
    assert not far.caught
    assert far.miss_m > mouth_m(GAME)


def test_a_ball_that_never_comes_over_the_rim_is_not_caught() -> None:
    assert not thrown(0.0, -0.1, 0.0, 0.2).caught
    assert not thrown(0.15, 0.02, 0.0, -0.1).caught


def test_the_ball_is_released_once_the_rope_has_been_slack_for_as_long_as_configured() -> None:
    goal = Goal(HARD.goal, Flight.of(GAME))
    for slack_s, steps in ((0.01, 5), (0.03, 15)):
        release = Release(learn_settings("hard", goal__slack_s=slack_s), goal)
        swing = CompiledRail(GAME, 0.002)
        swing.start(SwingState(0.0, 0.0, math.radians(130.0), 3.0))  # slower than sqrt(-g cos / l): the rope lets go
        waited = slack = 0
        while not release.after(swing) and waited < 100:
            swing.step(0.0)
            waited += 1
            slack = slack + 1 if swing.tension_n == 0.0 else 0
        assert slack == steps


def test_a_taut_rope_releases_nothing() -> None:
    release, swing = Release(HARD, Goal(HARD.goal, Flight.of(GAME))), CompiledRail(GAME, 0.002)
    swing.start(SwingState(0.0, 0.0, math.radians(100.0), 8.0))
    for _ in range(40):
        swing.step(0.0)
        assert not (release.after(swing) and swing.tension_n > 0.0)


def test_chance_solves_the_easy_task_and_not_the_hard_one() -> None:
    """Another 400 harmonics on hard: 1 succeeded; ten or more of 400 come at that rate less than once in a million."""
    assert random_success_rate(learn_settings("easy"), GAME) > 0.05
    assert random_success_rate(HARD, GAME) < 10 / 400
