from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.drive_kernel import Drive

PERIOD = 0.001
LOW, HIGH = np.array([-1.0, -0.5]), np.array([1.5, 0.5])
FASTEST, TOP = np.array([1.0, 2.0]), np.array([10.0, 40.0])
ROUNDING = 1e-9


def drive() -> Drive:
    made = Drive(JointLimits(LOW, HIGH, FASTEST, TOP, np.ones(2)), PERIOD)
    made.reset(np.zeros(2))
    return made


def played(made: Drive, reference: list[tuple[Array, Array, Array]]) -> tuple[Array, Array, Array]:
    a, q, v = zip(*((made.follow(*one), made.position_rad, made.velocity_rad_s) for one in reference), strict=True)
    return np.array(q), np.array(v), np.array(a)


def sine(amplitude: float, rate: float, steps: int) -> list[tuple[Array, Array, Array]]:
    t = PERIOD * np.arange(1, steps + 1)[:, None] * np.ones(2)
    wave = (
        amplitude * (1 - np.cos(rate * t)),
        amplitude * rate * np.sin(rate * t),
        amplitude * rate**2 * np.cos(rate * t),
    )
    return list(zip(*wave, strict=True))


def test_a_reference_within_the_limits_passes_unchanged() -> None:
    reference = sine(0.1, 8.0, 2000)
    q, v, a = played(drive(), reference)
    assert (q == [one[0] for one in reference]).all()
    assert (v == [one[1] for one in reference]).all()
    assert a[2:] == pytest.approx(np.diff(q, 2, axis=0) / PERIOD**2, abs=1e-8)  # places are exact to 1e-16


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), wild=st.floats(0.01, 30.0))
def test_whatever_is_asked_the_drive_keeps_to_all_limits(seed: int, wild: float) -> None:
    rng = np.random.default_rng(seed)
    made = drive()
    knots = rng.normal(0, wild, (12, 3, 2))
    reference = [tuple(knots[k // 80]) for k in range(960)]
    if seed % 2:
        reference = sine(0.2 * wild, rng.uniform(1, 30), 960)
    q, v, _ = played(made, reference)
    q, v = np.vstack([np.zeros(2), q]), np.vstack([np.zeros(2), v])
    assert (q <= HIGH + ROUNDING).all()
    assert (q >= LOW - ROUNDING).all()
    assert (np.abs(v) <= FASTEST * (1 + 2e-6)).all()
    assert (np.abs(np.diff(v, axis=0)) <= TOP * PERIOD * (1 + 2e-6)).all()


def test_positions_are_the_integral_of_speeds() -> None:
    q, v, _ = played(drive(), sine(2.0, 20.0, 800))
    step = np.diff(q, axis=0) - PERIOD * (v[1:] + v[:-1]) / 2
    assert np.abs(step).max() <= (TOP * PERIOD**2 / 6).max() * (1 + 1e-6)


def test_a_jump_is_caught_up_with_in_nearly_the_least_possible_time() -> None:
    """A rest-to-rest move of d takes at least 2 sqrt(d/A), or d/V + V/A where the top speed is reached."""
    made, goal = drive(), np.array([0.6, 0.4])
    q, v, _ = played(made, [(goal, np.zeros(2), np.zeros(2))] * 2000)
    assert np.abs(q[-1] - goal).max() < 1e-9
    assert np.abs(v[-1]).max() < 1e-9
    shortest_s = np.where(goal > FASTEST**2 / TOP, goal / FASTEST + FASTEST / TOP, 2 * np.sqrt(goal / TOP))
    arrived = PERIOD * (1 + np.array([np.flatnonzero(np.abs(q[:, j] - goal[j]) > 1e-3)[-1] for j in range(2)]))
    assert (arrived < 1.1 * shortest_s + 0.01).all()
    assert (q <= goal + 1e-6).all()


def test_a_moving_reference_is_caught_up_with_and_followed_exactly() -> None:
    made = drive()
    made.reset(np.array([0.3, -0.3]))
    reference = sine(0.1, 6.0, 3000)
    q, _, _ = played(made, reference)
    assert np.abs(q[1500:] - np.array([one[0] for one in reference])[1500:]).max() < 1e-9
    assert not made.limited


def test_one_joint_that_cannot_follow_does_not_hold_back_the_others() -> None:
    made = drive()
    still, far = np.zeros(2), np.array([9.0, 0.0])
    made.follow(far, still, still)
    assert made.limited
    assert made.position_rad[1] == 0.0
    assert 0 < made.position_rad[0] <= TOP[0] * PERIOD**2


def test_a_stop_is_reached_at_rest_and_kept() -> None:
    q, v, _ = played(drive(), [(np.array([99.0, -99.0]), np.zeros(2), np.zeros(2))] * 4000)
    assert q[-1] == pytest.approx([HIGH[0], LOW[1]], abs=1e-6)
    assert np.abs(v[-1]).max() < 1e-3
