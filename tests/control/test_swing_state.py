"""Position, angle and rates from tracked places of cup and ball."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.control.swing_state import SwingStateEstimator
from kendama_cli.devices.robot.interface import RobotState
from tests.physics.bare_rope import bare_rope

PERIOD_S = 0.004
MIDDLE_M = np.array([0.3, -0.2, 1.1])
X = np.array([1.0, 0.0, 0.0])
ROPE_M = 0.4


def seen(x: float, angle: float, noise: np.ndarray | float = 0.0) -> RobotState:
    cup = MIDDLE_M + np.array([x, 0.0, 0.0])
    ball = cup + ROPE_M * np.array([math.sin(angle), 0.0, -math.cos(angle)]) + noise
    return RobotState(np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(6), cup, ball, False)


def make_estimator(samples: int = 10, gravity_m_s2: float = 9.81) -> SwingStateEstimator:
    return SwingStateEstimator(PERIOD_S, samples, MIDDLE_M, X, rope=bare_rope(ROPE_M), gravity_m_s2=gravity_m_s2)


def swung(accelerations: list[float], angle: float, rate: float) -> list[tuple[float, float, float, float]]:
    """x, v, angle and rate after each period in which the cup accelerates so, by a hundred midpoint steps in each."""
    x = velocity = 0.0
    states, h = [], PERIOD_S / 100
    for a in accelerations:
        for _ in range(100):
            middle = angle + 0.5 * h * rate
            rate -= h * (9.81 * math.sin(middle) + a * math.cos(middle)) / ROPE_M
            angle = middle + 0.5 * h * rate
        x += PERIOD_S * (velocity + 0.5 * PERIOD_S * a)
        velocity += PERIOD_S * a
        states.append((x, velocity, angle, rate))
    return states


@pytest.mark.parametrize("samples", [2, 10, 15])
def test_a_driven_swing_is_followed_without_lag(samples: int) -> None:
    estimator = make_estimator(samples)
    accelerations = [8.0 if (k // 25) % 2 else -8.0 for k in range(200)]
    for k, (x, velocity, angle, rate) in enumerate(swung(accelerations, 0.4, 2.0)):
        state = estimator.update(seen(x, angle), accelerations[k])
        if k >= samples:
            assert state.x_m == pytest.approx(x, abs=1e-9)
            assert state.velocity_m_s == pytest.approx(velocity, abs=1e-6)
            assert state.angle_rad == pytest.approx(math.remainder(angle, 2 * math.pi), abs=2e-4)
            assert state.rate_rad_s == pytest.approx(rate, abs=0.02)


def test_an_acceleration_that_nobody_reported_shifts_the_rate_by_half_of_what_it_adds_in_the_window() -> None:
    n, unmodelled = 10, 3.0
    estimator = make_estimator(n, gravity_m_s2=0.0)
    for k in range(40):
        t = k * PERIOD_S
        state = estimator.update(seen(0.0, 0.5 * unmodelled * t * t), 0.0)
    assert state.rate_rad_s == pytest.approx(unmodelled * t - 0.5 * unmodelled * (n - 1) * PERIOD_S, abs=1e-6)


def test_the_angle_goes_round_without_a_jump_in_the_rate() -> None:
    estimator = make_estimator(gravity_m_s2=0.0)
    for k in range(800):
        state = estimator.update(seen(0.0, 6.0 * k * PERIOD_S), 0.0)
        assert -math.pi <= state.angle_rad <= math.pi
        if k > 0:
            assert state.rate_rad_s == pytest.approx(6.0, abs=1e-6)


@pytest.mark.parametrize("n", [10, 15])
def test_noise_reaches_the_rate_as_the_line_says(n: int) -> None:
    """The slope of a line through n readings deviates by sigma / h sqrt(12 / (n (n^2-1)))."""
    sigma = 0.0005
    rng = np.random.default_rng(3)
    estimator = make_estimator(n, gravity_m_s2=0.0)
    rates = [estimator.update(seen(0.0, 0.0, sigma * rng.standard_normal(3)), 0.0).rate_rad_s for _ in range(20000)][n:]
    gain = math.sqrt(12 / (n * (n * n - 1)))
    assert np.std(rates) == pytest.approx(gain * sigma / ROPE_M / PERIOD_S, rel=0.05)


def test_a_new_rollout_knows_nothing_of_the_last() -> None:
    estimator = make_estimator()
    for k in range(20):
        estimator.update(seen(0.01 * k, 0.1 * k), 1.0)
    estimator.begin()
    assert estimator.update(seen(0.0, 0.0), 0.0) == (0.0, 0.0, 0.0, 0.0)


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 2 samples, not 1"):
        make_estimator(1)
