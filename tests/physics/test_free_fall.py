"""Runge and Kutta's method against the exact solutions of two equations, and a landing against roots and sums."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.physics.free_fall import drag_n, drag_over_speed, fall_s, landing, runge_kutta
from kendama_cli.physics.taut_rope import Ball


def test_an_oscillation_is_off_by_the_fifth_power_of_the_step() -> None:
    """y'' = -y from (0, 1) is (sin t, cos t); half the step leaves a thirty-second of the error."""
    errors = []
    for step_s in (0.2, 0.1):
        made = runge_kutta(lambda y: np.array([y[1], -y[0]]), np.array([0.0, 1.0]), step_s)
        errors.append(float(np.abs(made - [np.sin(step_s), np.cos(step_s)]).max()))
    assert errors[0] / errors[1] == pytest.approx(32, rel=0.05)


def test_a_polynomial_of_the_fourth_degree_in_time_is_exact() -> None:
    """The state (t, t^4) moves with (1, 4 t^3)."""
    made = runge_kutta(lambda y: np.array([1.0, 4.0 * y[0] ** 3]), np.array([0.5, 0.5**4]), 0.7)
    assert made == pytest.approx([1.2, 1.2**4], rel=1e-14)


def test_a_cup_that_follows_its_acceleration_is_where_the_ball_lands() -> None:
    ball, cup_m, cup_m_s, rim_m = Ball(0.1, 0.2, -0.3, 1.0), 0.5, 0.7, 0.05
    found = landing(cup_m, cup_m_s, ball, rim_m, 9.81)
    time_s = max(np.roots([-0.5 * 9.81, ball.above_m_s, ball.above_m - rim_m]))
    assert found.time_s == pytest.approx(time_s)
    assert found.x_m == pytest.approx((cup_m + ball.across_m) + (cup_m_s + ball.across_m_s) * time_s)
    assert found.x_m == pytest.approx(cup_m + cup_m_s * time_s + 0.5 * found.acceleration_m_s2 * time_s**2)


def test_a_ball_below_the_plane_that_never_rises_to_it_does_not_land() -> None:
    """It needs v^2 > 2 g h; one that falls from above the plane lands as one that has risen before does."""
    assert fall_s(-0.2, math.sqrt(2 * 9.81 * 0.2) * 0.999, 9.81) == -math.inf
    assert fall_s(-0.2, math.sqrt(2 * 9.81 * 0.2) * 1.001, 9.81) > 0.0
    assert fall_s(0.3, -1.0, 9.81) == pytest.approx(max(np.roots([-0.5 * 9.81, -1.0, 0.3])))
    assert landing(0.4, 1.0, Ball(0.1, -0.5, 0.0, 0.0), 0.05, 9.81) == (-math.inf, 0.4, 0.0)
    sinking = landing(0.4, 1.0, Ball(0.1, 0.0, 0.0, -2.0), 0.05, 9.81)
    assert sinking.time_s <= 0.0
    assert sinking[1:] == (0.4, 0.0)


def test_the_air_pulls_against_the_motion_with_both_terms() -> None:
    velocity = np.array([1.0, -2.0, 0.5])
    speed = float(np.linalg.norm(velocity))
    assert drag_n(0.01, 0.003, tuple(velocity)) == pytest.approx(-(0.01 + 0.003 * speed) * velocity)
    assert drag_over_speed(0.01, 0.003, np.array([0.0, 2.0])) == pytest.approx([0.01, 0.016])
