"""One definition of a half-swing, whoever counts."""

from __future__ import annotations

import dataclasses
import math
from itertools import groupby
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.control.cup_cart import CartStep
from kendama_cli.control.swing_up import SwingUpRollout
from kendama_cli.learning.state import TURN_RAD_S, count_half_swings, swing_direction
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from tests.learning.settings_files import game_settings, learn_settings
from tests.simulation.swingup.test_environment import Scripted

RATES = st.lists(st.floats(-9, 9), max_size=30)


def test_simulation_and_robot_count_the_same_motion_alike() -> None:
    """A ball let go at 40 degrees: 2 s over half a period of 0.635 s, lengthened by 3 %, are four half-swings."""
    environment = SwingUpEnvironment(learn_settings(rollout_s=2.0), game_settings())
    noise = dataclasses.replace(environment.noiseless(), start_angle_rad=math.radians(40.0))
    steps = [CartStep(0.0, environment.state(), 0.0, cast(Any, None))]
    simulated = environment.roll_out(
        Scripted([0.0]),
        noise,
        lambda t_s, _, acceleration: steps.append(CartStep(t_s, environment.state(), acceleration, cast(Any, None))),
    )
    assert SwingUpRollout("timeout", tuple(steps)).half_swings == simulated.half_swings == 4


@pytest.mark.parametrize(
    ("rates", "counted"), [([], 0), ([0.4, -0.4], 0), ([3.0], 1), ([3.0, 0.1, -0.1, 3.0], 1), ([3.0, -3.0, 3.0], 3)]
)
def test_slow_stretches_begin_nothing(rates: list[float], counted: int) -> None:
    assert count_half_swings(rates) == counted


@given(RATES)
def test_they_are_the_runs_of_one_sign_among_the_fast_rates(rates: list[float]) -> None:
    assert count_half_swings(rates) == sum(1 for _ in groupby(rate > 0 for rate in rates if abs(rate) > TURN_RAD_S))


@given(RATES)
def test_a_mirrored_swing_has_as_many(rates: list[float]) -> None:
    assert count_half_swings(-rate for rate in rates) == count_half_swings(rates)


def test_a_direction_lasts_while_the_ball_is_slow() -> None:
    rates = [0.0, 2 * TURN_RAD_S, -0.9 * TURN_RAD_S, -2 * TURN_RAD_S, 0.9 * TURN_RAD_S]
    directions = [0]
    for rate_rad_s in rates:
        directions.append(swing_direction(rate_rad_s, directions[-1]))
    assert directions == [0, 0, 1, 1, -1, -1]
