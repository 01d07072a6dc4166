"""The cup never leaves its workspace, whatever is commanded."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from kendama_cli.motion.braking import BrakingLimiter, stoppable_m_s

STEP_S = 0.002
ROUNDING_M = 1e-9


def drive(limiter: BrakingLimiter, commands: list[float], *, gain: float = 1.0, lag_s: float = 0.0) -> np.ndarray:
    """Positions and speeds (2, n) under random commands, each held for 20 steps, semi-implicit Euler."""
    x = v = a = 0.0
    trail = []
    fade = math.exp(-STEP_S / lag_s) if lag_s else 0.0
    for command in commands:
        for _ in range(20):
            sent = limiter.limit(command, x, v) * gain
            a = sent + (a - sent) * fade
            v += STEP_S * a
            x += STEP_S * v
            trail.append((x, v))
    return np.array(trail).T


COMMANDS = st.lists(st.floats(-8.0, 8.0), min_size=1, max_size=80)
HARD = st.lists(st.sampled_from([-8.0, 8.0]), min_size=10, max_size=80)


@given(COMMANDS | HARD)
def test_the_cup_never_leaves_the_workspace_nor_exceeds_its_speed(commands):
    x, v = drive(BrakingLimiter(0.4, 2.0, 7.2, 8.0, STEP_S), commands)
    assert np.abs(x).max() <= 0.4 + ROUNDING_M
    assert np.abs(v).max() <= 2.0 + ROUNDING_M


@given(COMMANDS | HARD, st.floats(0.91, 1.0))
def test_an_actuator_that_brakes_a_little_less_than_commanded_is_kept_inside_by_the_reserve(commands, gain):
    x, _ = drive(BrakingLimiter(0.4, 2.0, 7.2, 8.0, STEP_S), commands, gain=gain)
    assert np.abs(x).max() <= 0.4 + 1e-4  # one step at the edge with 9 % less braking: far below 0.1 mm


def test_the_present_state_of_an_actuator_that_lags_lets_the_cup_out():
    x, _ = drive(BrakingLimiter(0.4, 2.0, 7.2, 8.0, STEP_S), [8.0] * 60, lag_s=0.04)
    assert np.abs(x).max() > 0.41


def test_far_from_every_edge_the_command_passes_unchanged():
    limiter = BrakingLimiter(0.4, 2.0, 7.2, 8.0, STEP_S)
    for command in (-8.0, -1.25, 0.0, 8.0):
        assert limiter.limit(command, 0.05, 0.3) == command


def test_the_cup_may_use_the_whole_workspace():
    x, _ = drive(BrakingLimiter(0.4, 2.0, 7.2, 8.0, STEP_S), [8.0] * 60)
    assert x[-1] == pytest.approx(0.4, abs=2e-3)


@given(st.floats(-0.45, 0.45), st.floats(-2.1, 2.1))
def test_the_bounds_are_where_braking_after_a_step_ends_at_the_edge(x, v):
    """With the speed w after a step, x + w h + w^2 / (2 b) + b h^2 / 2 = half width; within the largest speed."""
    limiter = BrakingLimiter(0.4, 2.0, 7.2, 8.0, 0.01)
    if abs(abs(x) - 0.4) < 1e-6:  # just at the edge rounding decides between the last speed and all there is
        return

    def highest(x: float, v: float) -> float:
        def over(w: float) -> float:
            return x + 0.01 * w + w * w / 14.4 + 0.5 * 7.2 * 1e-4 - 0.4

        least = -0.072  # where the parabola turns
        speed = min(brentq(over, least, 9.0), 2.0) if over(least) < 0.0 else -math.inf
        return max((speed - v) / 0.01, -8.0)

    assert limiter.limit(1e9, x, v) == pytest.approx(highest(x, v), abs=1e-6)
    assert limiter.limit(-1e9, x, v) == pytest.approx(-highest(-x, -v), abs=1e-6)
    assert stoppable_m_s(7.2, np.array([0.1]))[0] ** 2 / 14.4 == pytest.approx(0.1)
