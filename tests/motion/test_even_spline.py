"""A spline of even knots, and a cubic between two states: values and derivatives by scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from kendama_cli.motion.even_spline import EvenSpline, cubic_between


def test_an_even_spline_is_scipys_and_goes_on_beyond_its_ends() -> None:
    knots, values = -0.3 + 0.25 * np.arange(9), np.random.default_rng(10009).normal(size=(9, 3))
    made, wanted = EvenSpline(-0.3, 0.25, values), CubicSpline(knots, values)
    assert (made.start, made.step, made.end) == (-0.3, 0.25, knots[-1])
    for at in np.linspace(-0.5, 1.9, 49):
        point = made.at(float(at))
        for order, found in enumerate((point.value, point.first, point.second)):
            assert found == pytest.approx(wanted(at, order), abs=1e-9)


def test_a_cubic_between_two_states_is_hermites() -> None:
    (q0, v0, q1, v1), step_s, steps = np.random.default_rng(10010).normal(size=(4, 2)), 0.03, 7
    wanted = CubicHermiteSpline([0.0, steps * step_s], [q0, q1], [v0, v1])
    made = cubic_between((q0, v0), (q1, v1), steps=steps, step_s=step_s)
    for order, found in enumerate(made):
        assert found == pytest.approx(wanted(step_s * np.arange(1, steps + 1), order), abs=1e-9)
