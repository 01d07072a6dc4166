"""The cup's acceleration in every period of a catch: that of the cubic to where the ball comes down."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.control.catch_controller import CatchController, make_catch_geometry
from kendama_cli.control.cup_cart import CartStep
from kendama_cli.control.swing_up import SwingUpRollout
from kendama_cli.learning.state import SwingState
from tests.control.observed_games import GAME, TRANSFER

H, LATE_S, ARM_LATE_S, END_S = 0.004, 0.05, 0.02, 1.5
CATCH = dataclasses.replace(TRANSFER.catch, acceleration_m_s2=1e3, max_tilt_rad=0.0, contact_speed_m_s=0.0)
CENTER_M, ALONG = np.array([0.6, 0.1, 0.8]), np.array([0.6, 0.8, 0.0])
GEOMETRY = make_catch_geometry(CENTER_M, ALONG, GAME, CATCH, rope_scale=1.0, period_s=H)
LAST = SwingState(0.05, 0.4, 2.2, 5.0)


def begun(last: SwingState = LAST, *, tracked: bool = True, **settings: float) -> tuple[CatchController, Any]:
    cart: Any = SimpleNamespace(x_m=0.1, velocity_m_s=-0.2, period_s=H, delay_s=LATE_S, arm_lag_s=ARM_LATE_S)
    step: Any = CartStep(END_S, last, 0.0, None)  # type: ignore[arg-type]
    catch = dataclasses.replace(CATCH, **settings)
    swing = SwingUpRollout("goal", (step,))
    return CatchController(swing, cart, GEOMETRY, catch=catch, max_sigma_m=0.01, tracked=tracked), cart


def predicted(t_s: float, sigma_m: float = 0.001) -> Any:
    pose = CatchPose(
        t_s=t_s,
        position_m=CENTER_M + 0.2 * ALONG + [0.0, 0.0, 0.1],
        velocity_m_s=-0.5 * ALONG + np.array([0.0, 0.0, -2.5]),
        covariance_m2=np.eye(3) * sigma_m**2 / 3,
        time_sigma_s=0.001,
        rotation_wxyz=np.array([1.0, 0.0, 0.0, 0.0]),
        n_observations=30,
    )
    return SimpleNamespace(catch=pose)


def cubic_m_s2(t_s: float, end_s: float, target_m: float, speed_m_s: float, cart: Any) -> float:
    """The acceleration in the middle of the period on scipy's cubic from the cup's state to the ball's, matched."""
    ends = [cart.x_m, target_m], [cart.velocity_m_s, CATCH.matching * speed_m_s]
    return float(CubicHermiteSpline([t_s, end_s], *ends)(t_s + 0.5 * H, 2))


@pytest.mark.parametrize("tracked", [True, False])
def test_until_the_ball_is_seen_it_is_met_where_the_swing_ups_last_state_lands(tracked: bool) -> None:
    """Reference: the roots of its parabola; tracking is late in the swing-up, images are not."""
    controller, cart = begun(tracked=tracked)
    ball = GEOMETRY.flight.rope.ball(LAST.angle_rad, LAST.rate_rad_s)
    fall = max(np.roots([-0.5 * 9.81, ball.above_m_s, ball.above_m - GAME.cup.rim_m]))
    assert controller.catch_s == pytest.approx(END_S + fall - (0.0 if tracked else LATE_S - ARM_LATE_S))
    speed = LAST.velocity_m_s + ball.across_m_s
    lands_m = LAST.x_m + ball.across_m + speed * fall
    for t_s in (END_S, END_S + 0.05):
        end_s = controller.catch_s - (LATE_S if tracked else ARM_LATE_S)
        assert controller.acceleration_m_s2(t_s) == pytest.approx(cubic_m_s2(t_s, end_s, lands_m, speed, cart))
        cart.x_m, cart.velocity_m_s = 0.12, 0.3


def test_a_swing_that_lands_nowhere_is_awaited_where_the_cup_is() -> None:
    controller, _ = begun(SwingState(0.0, 0.3, 0.5, 0.1))
    assert controller.catch_s == END_S
    assert controller.acceleration_m_s2(END_S) == pytest.approx(min(0.2 / H, CATCH.braking_m_s2))


def test_a_prediction_that_is_certain_enough_is_followed_until_the_plan_is_frozen_and_then_the_cup_stops() -> None:
    controller, cart = begun()
    controller.follow(predicted(9.0, sigma_m=0.0101))
    assert controller.catch_s < 5.0
    controller.follow(predicted(2.0, sigma_m=0.0099))
    assert controller.catch_s == 2.0
    end_s = 2.0 - LATE_S
    planned = cubic_m_s2(1.7, end_s, 0.2, -0.5, cart)
    assert controller.acceleration_m_s2(1.7) == pytest.approx(planned)
    last_s = end_s - CATCH.freeze_before_catch_s - 1e-6
    spline = CubicHermiteSpline([last_s, end_s], [0.1, 0.2], [-0.2, -0.5 * CATCH.matching])
    controller.acceleration_m_s2(last_s)
    cart.x_m = 0.5  # what happens later changes nothing
    assert controller.acceleration_m_s2(last_s + H) == pytest.approx(float(spline(last_s + 1.5 * H, 2)))
    for speed, wanted in ((-0.01, 0.01 / H), (3.0, -CATCH.braking_m_s2), (-3.0, CATCH.braking_m_s2)):
        cart.velocity_m_s = speed
        assert controller.acceleration_m_s2(end_s) == pytest.approx(wanted)


def test_the_tilted_cup_is_aimed_beside_the_ball_by_its_lever_and_opens_against_the_relative_velocity() -> None:
    """The tilt of one period moves the aim of the next; it is planned from the ball's fall and the cup's yielding."""
    controller, cart = begun(max_tilt_rad=0.6, contact_speed_m_s=0.3)
    controller.follow(predicted(2.0))
    controller.acceleration_m_s2(1.7)
    tilt = math.atan2(0.5 - 0.5 * CATCH.matching, 2.5 - 0.3)
    lever_m = GAME.cup.rim_m - CATCH.below_rim_m
    assert GEOMETRY.below_rim_lever_m == pytest.approx(lever_m)
    wanted = cubic_m_s2(1.704, 2.0 - LATE_S, 0.2 - lever_m * math.sin(tilt), -0.5, cart)
    assert controller.acceleration_m_s2(1.704) == pytest.approx(wanted)
    assert begun()[0].tilt(1.7) is None
    unseen, _ = begun(max_tilt_rad=0.6)  # until it is seen the ball is taken to fall from 0.2 m over the cup
    ball = GEOMETRY.flight.rope.ball(LAST.angle_rad, LAST.rate_rad_s)
    unseen.acceleration_m_s2(END_S)
    across = (1 - CATCH.matching) * (LAST.velocity_m_s + ball.across_m_s)
    assert unseen._tilt_rad == pytest.approx(math.atan2(-across, math.sqrt(2 * 9.81 * 0.2)))
    tilts = [controller.tilt(1.7 + H * k) for k in range(round((0.3 - LATE_S) / H))]
    assert tilts[-1] is not None
    assert tilts[-1].tilt_rad == pytest.approx(tilt, abs=0.01)


def test_a_geometry_has_the_cups_heights_and_the_settings_limits() -> None:
    limiter = GEOMETRY.limiter
    assert GEOMETRY.rim_height_m == pytest.approx(0.8 + GAME.cup.rim_m + GAME.ball.radius_m)
    assert limiter == (CATCH.half_width_m, CATCH.max_speed_m_s, pytest.approx(0.9 * 1e3), 1e3, H)
    assert GEOMETRY.along(np.array([1.0, 2.0, 3.0])) == pytest.approx(2.2)
