"""Motions that the limits of joints allow."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.robot_model.limits import JointLimits

LIMITS = JointLimits(
    lower_rad=np.array([-1.0, -2.0]),
    upper_rad=np.array([1.0, 3.0]),
    velocity_rad_s=np.array([2.0, 2.0]),
    acceleration_rad_s2=np.array([5.0, 5.0]),
    effort_nm=np.array([9.0, 9.0]),
)


def test_the_nearer_stop_counts_and_beyond_it_the_distance_is_negative() -> None:
    found = LIMITS.to_stop_rad(np.array([[0.75, -1.5], [-1.5, 3.25]]))
    assert found.tolist() == [[0.25, 0.5], [-0.5, -0.25]]


@pytest.mark.parametrize("index", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_each_limit_is_allowed_itself_and_refused_beyond_for_its_own_joint(index: int, sign: float) -> None:
    state = [np.zeros(2), np.zeros(2), np.zeros(2)]
    stop = LIMITS.upper_rad[1] if sign > 0 else LIMITS.lower_rad[1]
    maximum = (stop, sign * LIMITS.velocity_rad_s[1], sign * LIMITS.acceleration_rad_s2[1])[index]
    state[index][1] = maximum
    assert LIMITS.allow(*state).tolist() == [True, True]
    state[index][1] = np.nextafter(maximum, sign * np.inf)
    assert LIMITS.allow(*state).tolist() == [True, False]


def test_what_is_no_number_is_not_allowed() -> None:
    assert not LIMITS.allow(np.array([np.nan, 0.0]), np.zeros(2), np.zeros(2)).all()
