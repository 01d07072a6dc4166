"""A planned motion stretched to the robot's periods, and held at its end."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.control.imitation import SETTLE_S, _from_rest, stretched


def test_a_motion_is_read_at_the_end_of_every_period_slower_by_tau_and_then_rests() -> None:
    """q(t / tau), q' / tau and q'' / tau^2 on straight lines between the plan's samples, whose times begin anywhere."""
    rows, period_s, tau = np.random.default_rng(10022).normal(size=(3, 90, 2)), 0.007, 1.3
    motion = JointTrajectory(("a", "b"), 0.5 + 0.01 * np.arange(90), *rows)
    made = stretched(motion, tau, period_s)
    assert made.t_s == pytest.approx(period_s * np.arange(1, round((0.89 * tau + SETTLE_S) / period_s) + 1))
    moving = made.t_s <= 0.89 * tau
    for order, (found, planned) in enumerate(
        zip((made.position_rad, made.velocity_rad_s, made.acceleration_rad_s2), rows, strict=True)
    ):
        for joint in range(2):
            wanted = np.interp(made.t_s / tau, 0.01 * np.arange(90), planned[:, joint]) / tau**order
            assert found[:, joint] == pytest.approx(np.where(moving | (order == 0), wanted, 0.0))
    begun = _from_rest(made, np.array([9.0, 8.0]))
    assert begun.t_s == pytest.approx([0.0, *made.t_s])
    assert begun.position_rad == pytest.approx(np.vstack([[9.0, 8.0], made.position_rad]))
    assert not begun.velocity_rad_s[0].any()
    assert not begun.acceleration_rad_s2[0].any()
    assert np.array_equal(begun.velocity_rad_s[1:], made.velocity_rad_s)
