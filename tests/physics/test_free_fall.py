"""Runge and Kutta's method against the exact solutions of two equations, and a landing against roots and sums."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.physics.free_fall import landing, runge_kutta
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
