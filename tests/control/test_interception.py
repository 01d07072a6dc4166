"""The way of the cup to the ball: on time, in place, within the limit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from kendama_cli.control.interception import plan_interception


def test_the_speed_is_the_nearest_that_both_accelerations_allow_or_else_the_first() -> None:
    """Reference: scipy's cubic, whose end accelerations are linear in the final speed: many speeds tried out."""
    rng, both = np.random.default_rng(10005), []
    for _ in range(100):
        v, way, wanted, left = *rng.normal(0, [1.0, 0.3, 1.0]), rng.uniform(0.1, 0.6)
        cubics = [CubicHermiteSpline([0, left], [0, way], [v, w]).derivative(2)([0, left]) for w in (0.0, 1.0)]
        speeds = np.linspace(-40.0, 40.0, 40001)
        ends = np.abs(cubics[0] + speeds[:, None] * (cubics[1] - cubics[0])) <= 14.0
        allowed = ends.all(axis=1)
        both.append(allowed.any())
        tried = speeds[allowed if allowed.any() else ends[:, 0]]
        speed = tried[np.abs(tried - wanted).argmin()]
        plan = plan_interception(
            displacement_m=way, velocity_m_s=v, desired_m_s=wanted, start_s=1.0, end_s=1.0 + left, limit_m_s2=14.0
        )
        assert plan.speed_m_s == pytest.approx(speed, abs=2.1e-3)
        first, last = cubics[0] + plan.speed_m_s * (cubics[1] - cubics[0])
        assert (plan.first_m_s2, plan.last_m_s2) == pytest.approx((first, np.clip(last, -14.0, 14.0)))
        read = [plan.acceleration_m_s2(1.0 + at * left) for at in (-0.5, 0.25, 1.5)]
        assert read == pytest.approx([first, 0.75 * first + 0.25 * plan.last_m_s2, plan.last_m_s2])
    assert 0.2 < np.mean(both) < 0.95
