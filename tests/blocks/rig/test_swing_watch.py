"""Position, angle and rates from tracked places of cup and ball."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.blocks.rig.swing_watch import SwingWatch
from kendama_cli.blocks.robot.interface import RobotState

PERIOD_S = 0.004
MIDDLE_M = np.array([0.3, -0.2, 1.1])
X = np.array([1.0, 0.0, 0.0])


def seen(x: float, angle: float, noise: np.ndarray | float = 0.0) -> RobotState:
    cup = MIDDLE_M + np.array([x, 0.0, 0.0])
    ball = cup + 0.4 * np.array([math.sin(angle), 0.0, -math.cos(angle)]) + noise
    return RobotState(np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(6), cup, ball, False)


def test_constant_accelerations_are_followed_without_lag() -> None:
    watch = SwingWatch(PERIOD_S, 10, MIDDLE_M, X)
    for k in range(60):
        t = k * PERIOD_S
        state = watch.see(seen(0.1 + 0.5 * t - 2.0 * t * t, 0.2 - 1.5 * t + 8.0 * t * t))
    assert state.x_m == pytest.approx(0.1 + 0.5 * t - 2.0 * t * t, abs=1e-9)
    assert state.velocity_m_s == pytest.approx(0.5 - 4.0 * t, abs=1e-7)
    assert state.angle_rad == pytest.approx(0.2 - 1.5 * t + 8.0 * t * t, abs=1e-9)
    assert state.rate_rad_s == pytest.approx(-1.5 + 16.0 * t, abs=1e-6)


def test_the_angle_goes_round_without_a_jump_in_the_rate() -> None:
    watch = SwingWatch(PERIOD_S, 10, MIDDLE_M, X)
    for k in range(800):
        state = watch.see(seen(0.0, 6.0 * k * PERIOD_S))
        assert -math.pi <= state.angle_rad <= math.pi
        if k > 3:
            assert state.rate_rad_s == pytest.approx(6.0, abs=1e-6)


def test_noise_reaches_the_rate_as_the_parabola_says() -> None:
    """At the end of n readings the slope's deviation is sigma / h sqrt(12 (2n-1) (8n-11) / (n (n^2-1) (n^2-4)))."""
    n, sigma = 10, 0.0005
    rng = np.random.default_rng(3)
    watch = SwingWatch(PERIOD_S, n, MIDDLE_M, X)
    rates = [watch.see(seen(0.0, 0.0, sigma * rng.standard_normal(3))).rate_rad_s for _ in range(20000)][n:]
    gain = math.sqrt(12 * (2 * n - 1) * (8 * n - 11) / (n * (n * n - 1) * (n * n - 4)))
    assert np.std(rates) == pytest.approx(gain * sigma / 0.4 / PERIOD_S, rel=0.05)


def test_a_new_rollout_knows_nothing_of_the_last() -> None:
    watch = SwingWatch(PERIOD_S, 10, MIDDLE_M, X)
    for k in range(20):
        watch.see(seen(0.01 * k, 0.1 * k))
    watch.begin()
    assert watch.see(seen(0.0, 0.0)) == (0.0, 0.0, 0.0, 0.0)


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 3 samples, not 2"):
        SwingWatch(PERIOD_S, 2, MIDDLE_M, X)
