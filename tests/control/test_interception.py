"""The way of the cup to the ball: on time, in place, within the limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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


def test_with_room_enough_position_and_speed_are_both_met() -> None:
    place, speed, peak = driven(0.3, 0.15, -0.5, 0.4, 20.0)
    assert place == pytest.approx(0.15, abs=1e-6)
    assert speed == pytest.approx(-0.5, abs=1e-6)
    assert peak <= 20.0


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
