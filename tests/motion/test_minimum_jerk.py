from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.motion.minimum_jerk import step, step_change, step_integral, step_rate

U = np.linspace(0.0, 1.0, 2001)


def test_the_step_rests_before_and_after_and_is_symmetric() -> None:
    assert step([-1.0, 0.0, 0.5, 1.0, 2.0]) == pytest.approx([0, 0, 0.5, 1, 1])
    assert step(U) + step(1 - U) == pytest.approx(np.ones(2001))
    for end in (-1.0, 0.0, 1.0, 2.0):
        assert step_rate(end) == step_change(end) == 0.0


def test_rate_change_and_integral_are_those_of_the_step() -> None:
    inner, h = U[1:-1], 1e-5
    # central differences of h = 1e-5 err by h^2 / 6 of the third derivative, at most 360, and by rounding / h
    assert (step(inner + h) - step(inner - h)) / (2 * h) == pytest.approx(step_rate(inner), abs=1e-8)
    assert (step_rate(inner + h) - step_rate(inner - h)) / (2 * h) == pytest.approx(step_change(inner), abs=1e-8)
    assert (step_integral(inner + h) - step_integral(inner - h)) / (2 * h) == pytest.approx(step(inner), abs=1e-8)
    assert step_integral(0.0) == 0.0
    assert step_integral(1.0) == 0.5


def test_no_other_step_between_the_same_rests_has_less_jerk() -> None:
    """Adding any bump u^3 (1 - u)^3 p(u) keeps the rests and can only add to the integral of the squared jerk."""
    polynomial = np.polynomial.Polynomial
    quintic = polynomial([0, 0, 0, 10, -15, 6])
    bump = polynomial([0, 0, 0, 1, -3, 3, -1])

    def jerk(path: np.polynomial.Polynomial) -> float:
        whole = (path.deriv(3) ** 2).integ()
        return float(whole(1.0) - whole(0.0))

    assert quintic(U) == pytest.approx(step(U))
    for factor in (polynomial([1.0]), polynomial([-0.5]), polynomial([0.1, 2.0]), polynomial([1.0, -3.0, 1.0])):
        assert jerk(quintic + 0.1 * bump * factor) > jerk(quintic) == pytest.approx(720.0)
