"""One step of Runge and Kutta's method against the exact solutions of two equations."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.physics.free_fall import runge_kutta


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
