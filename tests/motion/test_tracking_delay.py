"""The delay of every joint is told, whatever the motion was parted into, and what it explains is taken out."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.motion.tracking_delay import LEAST_RAD, LONGEST_S, _lowest, tracking

PERIOD_S = 0.004


def swing(t_s: np.ndarray) -> np.ndarray:
    """Three joints; the last stands still."""
    return np.column_stack([0.4 * np.sin(7.0 * t_s), 0.1 * np.cos(11.0 * t_s) + 0.2 * np.sin(3 * t_s), 0.0 * t_s])


@pytest.mark.parametrize("delay_s", [0.0, 0.004, 0.0137, 0.025, 0.09])
def test_each_joints_delay_is_found_to_a_tenth_of_a_period(delay_s: float) -> None:
    t_s = PERIOD_S * np.arange(1, 1500)
    found = tracking(t_s, swing(t_s), swing(t_s - delay_s))
    assert found.delay_s[:2] == pytest.approx([delay_s] * 2, abs=0.1 * PERIOD_S)
    assert np.isnan(found.delay_s[2])
    assert (found.residual_rms_rad < 1e-3).all()
    assert found.rms_rad[0] == pytest.approx(0.4 * 7 * delay_s / np.sqrt(2), rel=0.1, abs=1e-12)


def test_noise_is_what_is_left() -> None:
    rng = np.random.default_rng(10000)
    t_s = PERIOD_S * np.arange(1, 3000)
    noise = 3e-4 * rng.standard_normal((len(t_s), 3))
    found = tracking(t_s, swing(t_s), swing(t_s - 0.02) + noise)
    assert found.delay_s[:2] == pytest.approx([0.02] * 2, abs=2e-4)
    assert found.residual_rms_rad == pytest.approx([3e-4] * 3, rel=0.1)
    assert (found.largest_rad >= found.rms_rad).all()


def test_no_delay_reaches_over_a_gap_between_two_motions() -> None:
    t_s = PERIOD_S * np.arange(1, 400)
    one, other = swing(t_s), swing(t_s + 1.3)
    late = [swing(t_s - 0.03), swing(t_s + 1.3 - 0.03)]
    found = tracking(np.concatenate([t_s, t_s + 5.0]), np.vstack([one, other]), np.vstack(late))
    assert found.delay_s[:2] == pytest.approx([0.03] * 2, abs=0.1 * PERIOD_S)
    assert found.residual_rms_rad[0] < 0.01 * found.rms_rad[0]


def test_a_joint_that_hardly_moves_has_no_delay() -> None:
    t_s = PERIOD_S * np.arange(1, 400)
    small = 0.5 * LEAST_RAD * np.sin(5 * t_s)[:, None]
    assert np.isnan(tracking(t_s, small, small).delay_s).all()


@pytest.mark.parametrize(
    ("samples", "late", "found"), [(60, 29, True), (60, 33, False), (400, 37, True), (400, 45, False)]
)
def test_delays_up_to_the_longest_are_found_in_half_of_the_samples(samples: int, late: int, found: bool) -> None:
    """Random commands: but for the right shift no other resembles the measurement."""
    sent = np.random.default_rng(10011).normal(0.0, 0.1, (samples + late, 1))
    made = tracking(PERIOD_S * np.arange(samples), sent[late:], sent[:samples])
    assert (abs(float(made.delay_s[0]) - late * PERIOD_S) < PERIOD_S) == found
    assert (late * PERIOD_S <= LONGEST_S) == (late <= 37)
    assert (float(made.residual_rms_rad[0]) < 0.05) == found
    assert made.rms_rad == pytest.approx(np.sqrt(np.mean((sent[:samples] - sent[late:]) ** 2)))
    assert made.largest_rad == pytest.approx(np.abs(sent[:samples] - sent[late:]).max())


@pytest.mark.parametrize("at", [1.2, 2.0, 4.9])
def test_a_parabola_tells_the_lowest_point_between_steps(at: float) -> None:
    steps = np.arange(7)
    assert _lowest(0.3 + 2.0 * (steps - at) ** 2) == pytest.approx((at, 0.3))
    assert _lowest((steps - at) ** 2 - 1.0) == pytest.approx((at, 0.0)), "no mean square is below zero"
    assert _lowest(np.array([0.5, 1.0, 2.0])) == (0.0, 0.5)
    assert _lowest(np.array([2.0, 1.0, 0.5])) == (2.0, 0.5)
    assert _lowest(np.array([2.0, 0.5, np.inf])) == (1.0, 0.5)
    assert _lowest(np.array([1.0, 1.0, 1.0])) == (0.0, 1.0)
