"""Paths that are bent by bumps, and goals that are moved while the ball flies."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.adaptation.catch_family import bumped_plan, bumps, shifted_plan
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.motion.dmp.primitive import play
from tests.motion.swings import demonstration, settings

HEIGHTS_M = (0.03, 0.0, -0.02, 0.0, 0.0, 0.01, 0.0, 0.04)


@pytest.fixture(scope="module")
def plan() -> MotionPlan:
    return encode_demonstrations([demonstration()], settings())


def _moved(plan: MotionPlan, heights_m: tuple[float, ...], share: np.ndarray) -> np.ndarray:
    t_s = share * plan.duration_s
    return np.asarray(play(bumped_plan(plan, heights_m), t_s).position_m - play(plan, t_s).position_m)


def test_the_path_follows_the_bumps_and_its_ends_stay(plan: MotionPlan) -> None:
    """Twenty functions follow four bumps along each axis within 0.35 mm of 40; bounds at twice that."""
    fraction = np.linspace(0.0, 1.0, 500)
    moved = _moved(plan, HEIGHTS_M, fraction)
    desired = np.reshape(HEIGHTS_M, (2, 4)) @ bumps(4)
    assert moved[:, 0] == pytest.approx(desired[0], abs=7e-4)
    assert moved[:, 2] == pytest.approx(desired[1], abs=7e-4)
    assert moved[:, 1] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(moved).max() > 0.03
    assert np.abs(moved[[0, -1]]).max() < 7e-4
    assert _moved(plan, HEIGHTS_M, np.array([3.0])) == pytest.approx(0.0, abs=1e-6)


def test_bumps_are_smooth_of_height_one_and_nothing_at_the_ends() -> None:
    shape = bumps(4)
    assert shape.max(axis=1) == pytest.approx(1.0, abs=0.01)
    assert shape[:, [0, -1]] == pytest.approx(0.0)
    assert np.abs(np.diff(shape, 2, axis=1)).max() < 1e-3


def test_twice_the_heights_bend_twice_as_far_and_none_not_at_all(plan: MotionPlan) -> None:
    once, twice = (bumped_plan(plan, tuple(k * one for one in HEIGHTS_M)).weights - plan.weights for k in (1.0, 2.0))
    assert twice == pytest.approx(2 * once, rel=1e-9)
    assert np.array_equal(bumped_plan(plan, (0.0,) * 8).weights, plan.weights)


def test_a_coordinate_that_the_motion_has_not_is_not_bent(plan: MotionPlan) -> None:
    m = len(plan.centers)
    rows = slice(0, 1)
    only_x = dataclasses.replace(
        plan,
        coordinates=("x",),
        start_m=plan.start_m[rows],
        start_velocity_m_s=plan.start_velocity_m_s[rows],
        goal_m=plan.goal_m[rows],
        goal_velocity_m_s=plan.goal_velocity_m_s[rows],
        weights=plan.weights[rows],
        variation=np.zeros((0, 1 + 3 + m)),
    )
    assert bumped_plan(only_x, HEIGHTS_M).weights[0] == pytest.approx(bumped_plan(plan, HEIGHTS_M).weights[0])


FLIGHT = (0.55, 0.75)
SHIFT_M = (0.1, -0.04)


def _shifted(plan: MotionPlan, share: np.ndarray) -> np.ndarray:
    t_s = share * plan.duration_s
    return np.asarray(play(shifted_plan(plan, SHIFT_M, FLIGHT), t_s).position_m - play(plan, t_s).position_m)


def test_the_motion_before_the_flight_stays_and_after_it_runs_beside_itself(plan: MotionPlan) -> None:
    """Twenty functions follow a step of a fifth of the motion within some percent of it."""
    before = _shifted(plan, np.linspace(0.0, FLIGHT[0] - 0.05, 100))
    after = _shifted(plan, np.linspace(FLIGHT[1] + 0.02, 1.0, 100))
    assert np.abs(before).max() < 0.03 * SHIFT_M[0]
    assert np.abs(after - [*SHIFT_M, 0.0]).max() < 0.06 * SHIFT_M[0]


def test_it_settles_exactly_at_the_goal_so_shifted(plan: MotionPlan) -> None:
    assert _shifted(plan, np.array([3.0]))[0] == pytest.approx([*SHIFT_M, 0.0], abs=1e-6)
    assert shifted_plan(plan, SHIFT_M, FLIGHT).goal_m - plan.goal_m == pytest.approx([*SHIFT_M, 0.0])


def test_no_shift_changes_nothing(plan: MotionPlan) -> None:
    same = shifted_plan(plan, (0.0, 0.0), FLIGHT)
    assert np.array_equal(same.weights, plan.weights)
    assert np.array_equal(same.goal_m, plan.goal_m)
