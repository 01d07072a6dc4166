"""Paths that are bent by bumps, and goals that are moved while the ball flies."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from kendama_cli.adaptation.catch_family import (
    PHASE,
    CatchFamily,
    attempt_of,
    bumped_plan,
    bumps,
    shifted_plan,
    weight_changes,
)
from kendama_cli.adaptation.search_record import Attempt, MotionVariation
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
    # as wide as they are apart, and half as high half-way through an end
    assert np.interp([0.4, 0.6, 0.8], PHASE, shape[1]) == pytest.approx(np.exp([0.0, -0.5, -2.0]), abs=1e-4)
    assert np.interp([0.075, 0.925], PHASE, shape[0]) == pytest.approx(
        0.5 * np.exp([-0.5 * 0.625**2, -0.5 * 3.625**2]), abs=1e-4
    )


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


def test_weights_that_displace_a_path_are_the_least_squares_of_what_each_moves(plan: MotionPlan) -> None:
    """Weights by numpy's least squares, from 21 played motions: one with a moved goal and one for each weight."""
    plan = dataclasses.replace(plan, tau_scale=1.2)
    desired, goal = np.vstack((np.sin(4 * PHASE), PHASE**2)), np.array([0.7, 1.3])
    t_s = PHASE * 1.2 * plan.duration_s
    unit = np.eye(len(plan.centers))[:, None] * [[1.0], [0.0], [0.0]]
    before = play(plan, t_s).position_m
    columns = [play(dataclasses.replace(plan, weights=plan.weights + one), t_s).position_m - before for one in unit]
    by_goal = play(dataclasses.replace(plan, goal_m=plan.goal_m + 1.0), t_s).position_m[:, 0] - before[:, 0]
    moves = np.array(columns)[:, :, 0].T
    found = np.linalg.lstsq(moves, desired.T - np.outer(by_goal, goal))[0]
    made = weight_changes(plan, desired, goal)
    assert made @ moves.T == pytest.approx((moves @ found).T, abs=1e-5)


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


@pytest.mark.parametrize(("forward_m", "forward"), [(0.3, 1.0), (-0.3, -1.0), (None, 1.0), (0.0, 1.0)])
def test_an_attempt_tells_its_flight_in_fractions_of_the_primitive(forward_m: float | None, forward: float) -> None:
    """At tau 1.25 the rope slackens 2 s after the start: 1.6 s of the plan, after 0.2 s of lead-in 0.7 of its 2 s."""
    swing: Any = SimpleNamespace(lead_in_s=0.2, plan=SimpleNamespace(duration_s=2.0))
    result: Any = SimpleNamespace(
        flight_s=(2.0, 2.5), caught=True, signed_miss_m=0.01, side_miss_m=-0.02, apex_m=0.3, swing_slack_s=0.04,
        forward_m=forward_m,
    )  # fmt: skip
    made = attempt_of(MotionVariation(1.25), swing, result, 0.05)
    assert made.flight == pytest.approx((0.7, 0.9))
    assert dataclasses.replace(made, flight=None) == Attempt(
        MotionVariation(1.25), True, 0.01, -0.02, 0.3, None, swing_slack_s=0.04, correction_m=0.05, forward=forward
    )
    result.flight_s = None
    assert attempt_of(MotionVariation(1.25), swing, result).flight is None


def test_a_motion_is_as_much_slower_as_the_arm_asks_for_and_the_range_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    family = CatchFamily(cast("Any", None), cast("Any", None), 3.0)
    swing = SimpleNamespace(min_tau_scale=lambda: 1.1, limiting_joint=lambda: "joint 's3'")
    monkeypatch.setattr(CatchFamily, "swing", lambda self, variation: swing)
    taus = [(tau, family.within_limits(MotionVariation(tau), (0.8, 1.2)).tau_scale) for tau in (1.0, 1.15, 1.3)]
    assert taus == [(1.0, 1.1), (1.15, 1.15), (1.3, 1.2)]
    assert family.within_limits(MotionVariation(1.0), (1.12, 1.2)).tau_scale == 1.12
    assert family.limit(MotionVariation(1.1)) is None
    assert family.limit(MotionVariation(1.09)) == "joint 's3'"
    assert family.lowest_tau(0.9) == 1.1
