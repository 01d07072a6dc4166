"""The goal: angle, rate, and a catch within reach."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.learning.reward import Flight, Goal, final_reward, step_reward
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.taut_rope import Ball
from tests.learning.settings_files import learn_settings
from tests.physics.bare_rope import bare_rope

FLIGHT = Flight(bare_rope(0.40), 0.07, 9.81)

COSTLY = {"reward__step": -0.2, "reward__displacement_per_m": 100.0, "reward__displacement_free_m": 0.3}


def goal(**replaced: object) -> Goal:
    return Goal(learn_settings(**{f"goal__{key}": value for key, value in replaced.items()}).goal, FLIGHT)


STATE = st.builds(SwingState, st.floats(-0.4, 0.4), st.floats(-2, 2), st.floats(-3.1, 3.1), st.floats(-10, 10))


@given(STATE)
def test_left_and_right_are_alike(state):
    assert goal().reached(state) == goal().reached(SwingState(*(-part for part in state)))


@given(STATE)
def test_a_catchable_state_has_the_wanted_angle_and_rate_too(state):
    assert goal(success="reached").reached(state) or not goal().reached(state)
    assert goal().reached(state) or not goal(success="caught").reached(state)


def test_the_angle_and_rate_count_to_their_limits_and_not_beyond():
    plain = goal(success="reached")
    at = lambda angle, rate: plain.reached(SwingState(0.0, 0.0, math.radians(angle), rate))  # noqa: E731
    assert at(110.01, 3.0)
    assert at(149.99, 3.0)
    assert not at(109.9, 3.0)
    assert not at(150.1, 3.0)
    assert not at(130.0, 0.99)
    assert not at(130.0, 6.01)
    assert not at(130.0, -3.0)


@given(STATE)
def test_a_state_that_is_caught_from_needs_a_rope_that_has_no_pull(state):
    # on the bare circle: l rate^2 + g cos(angle) is the pull over the mass, for a cup that does not accelerate
    if goal(success="caught").reached(state):
        assert 0.4 * state.rate_rad_s**2 + 9.81 * math.cos(state.angle_rad) <= 1e-9


def test_the_slower_ball_is_released_and_the_faster_one_is_still_held():
    desired = goal(success="caught", angle_deg=130.0, min_rate_rad_s=0.3)
    slow, fast = (SwingState(0.0, 0.0, math.radians(140.0), rate) for rate in (3.5, 5.0))
    assert desired.reached(slow)
    assert not desired.reached(fast)
    assert goal(min_rate_rad_s=0.3).reached(fast)


def test_a_miss_is_worth_the_more_the_nearer_it_is():
    rewards = learn_settings("hard", reward__missed=50.0, reward__missed_range_m=0.2).reward
    assert [final_reward(rewards, "missed", miss) for miss in (0.0, 0.05, 0.2, 0.7)] == [50.0, 37.5, 0.0, 0.0]
    assert final_reward(rewards, "missed") == 50.0
    assert final_reward(rewards, "goal", 0.01) == 100.0


def test_a_landing_outside_or_a_cup_too_slow_is_not_catchable():
    state = SwingState(0.0, 0.0, math.radians(130), 4.0)
    assert goal().reached(state)
    assert not goal(landing_limit_m=0.01).reached(state)
    assert not goal(catch_acceleration_m_s2=0.5).reached(state)


@given(STATE)
def test_the_landing_is_where_the_parabola_meets_the_rim(state):
    landing = FLIGHT.landing(state)
    if landing is None:
        return
    x, v, angle, rate = state
    t = landing.time_s
    z = -0.4 * math.cos(angle) + 0.4 * rate * math.sin(angle) * t - 0.5 * 9.81 * t * t
    ball_x = x + 0.4 * math.sin(angle) + (v + 0.4 * rate * math.cos(angle)) * t
    assert z == pytest.approx(0.07, abs=1e-9)
    assert 0.4 * rate * math.sin(angle) - 9.81 * t < 0  # on the way down
    assert landing.x_m == pytest.approx(ball_x, abs=1e-12)
    assert x + v * t + 0.5 * landing.acceleration_m_s2 * t * t == pytest.approx(ball_x, abs=1e-9)


def test_a_ball_that_stays_below_the_rim_lands_nowhere():
    assert FLIGHT.landing(SwingState(0, 0, math.radians(60), 0.5)) is None
    assert FLIGHT.fall(0.0, 0.0, Ball(0.0, 0.0, 0.0, 0.5)) is None


def test_displacement_costs_beyond_the_free_range_only():
    rewards = learn_settings(
        "paper_caught", reward__step=-0.2, reward__displacement_per_m=100.0, reward__displacement_free_m=0.3
    ).reward
    assert step_reward(rewards, 0.29) == -0.2
    assert step_reward(rewards, -0.35) == pytest.approx(-0.2 - 5.0)
    assert [final_reward(rewards, outcome) for outcome in ("goal", "timeout", "outside")] == [100.0, -5.0, -30.0]
