"""The cup never leaves its workspace, whatever is commanded."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.motion.braking import BrakingLimiter

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


@given(st.floats(-8, 8), st.floats(-0.39, 0.39), st.floats(-1.9, 1.9))
def test_left_and_right_are_alike(command, x, v):
    limiter = BrakingLimiter(0.4, 2.0, 7.2, 8.0, STEP_S)
    assert limiter.limit(-command, -x, -v) == pytest.approx(-limiter.limit(command, x, v), abs=1e-9)


def test_outside_by_a_disturbance_it_brakes_with_all_there_is():
    limiter = BrakingLimiter(0.4, 2.0, 7.2, 8.0, STEP_S)
    assert limiter.limit(8.0, 0.45, 0.5) == -8.0
    assert limiter.limit(-8.0, -0.45, -0.5) == 8.0
