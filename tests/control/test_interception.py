"""The way of the cup to the ball: on time, in place, within the limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from kendama_cli.control.interception import plan_interception

STEPS = 2000


def driven(v: float, way: float, wanted: float, left: float, limit: float) -> tuple[float, float, float]:
    """Final place and speed of a cup that follows the approach exactly, and its peak acceleration."""
    plan = plan_interception(
        displacement_m=way, velocity_m_s=v, desired_m_s=wanted, start_s=1.0, end_s=1.0 + left, limit_m_s2=limit
    )
    h = left / STEPS
    t = 1.0 + h * (np.arange(STEPS) + 0.5)
    a = np.array([plan.acceleration_m_s2(float(one)) for one in t])
    speed = v + np.concatenate([[0.0], np.cumsum(a) * h])
    place = float(np.sum(speed[:-1] * h + 0.5 * a * h * h))
    return place, float(speed[-1]), float(np.abs(a).max())


def test_the_speed_is_the_nearest_that_both_accelerations_allow_or_else_the_first() -> None:
    """By scipy's cubic, whose accelerations at both ends are linear in the final speed: many speeds tried out."""
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


@given(st.floats(-1.5, 1.5), st.floats(-0.25, 0.25), st.floats(-2, 2))
def test_the_position_comes_before_the_speed(v: float, way: float, wanted: float) -> None:
    left, limit = 0.35, 25.0
    place, _, peak = driven(v, v * left + way, wanted, left, limit)
    assert peak <= limit + 1e-9
    assert place == pytest.approx(v * left + way, abs=1e-6)


@given(st.floats(-3, 3), st.floats(-2, 2), st.floats(-3, 3), st.floats(0.02, 1.0))
def test_the_first_acceleration_never_exceeds_the_limit(v: float, way: float, wanted: float, left: float) -> None:
    plan = plan_interception(
        displacement_m=way, velocity_m_s=v, desired_m_s=wanted, start_s=0.0, end_s=left, limit_m_s2=14.0
    )
    assert abs(plan.first_m_s2) <= 14.0 + 1e-6
    assert abs(plan.last_m_s2) <= 14.0 + 1e-6
