"""Step by step: the same motion as in one go, and what changes on the fly do to it."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.averaging import encode_demonstrations
from kendama_cli.motion.dmp import play
from kendama_cli.motion.player import DmpPlayer
from tests.motion.swings import demonstration, path, settings


@pytest.fixture(scope="module")
def plan() -> MotionPlan:
    return encode_demonstrations([demonstration(head_s=0.2, tail_s=0.2)], settings())


@pytest.fixture(scope="module")
def cut_plan() -> MotionPlan:
    t = np.arange(0.5, 1.2, 0.01)
    return encode_demonstrations([Demonstration("cut", t, path(t))], settings())


def run(player: DmpPlayer, until_s: float, dt_s: float = 0.01) -> np.ndarray:
    return np.array([player.step(dt_s).position_m for _ in range(round(until_s / dt_s))])


@pytest.mark.parametrize("dt_s", [0.001, 0.01, 0.033])
def test_undisturbed_it_plays_the_primitive(cut_plan: MotionPlan, dt_s: float) -> None:
    """Within the motion, over its end, and during the hold."""
    player = DmpPlayer(cut_plan)
    for number in range(1, round(1.2 / dt_s)):
        made, truth = player.step(dt_s), play(cut_plan, np.array([number * dt_s]))
        assert np.abs(made.position_m - truth.position_m[0]).max() < 1e-8
        assert np.abs(made.velocity_m_s - truth.velocity_m_s[0]).max() < 1e-6
        # the instant of the end itself belongs to one side or the other
        if abs(number * dt_s - cut_plan.duration_s) > 1e-9:
            assert np.abs(made.acceleration_m_s2 - truth.acceleration_m_s2[0]).max() < 1e-4


def test_halving_the_step_divides_its_error_by_sixteen(cut_plan: MotionPlan) -> None:
    end = 1.1 * cut_plan.duration_s
    errors = []
    exact = DmpPlayer(cut_plan, step_share=1 / 2000).step(end).position_m
    for steps in (50, 100, 200, 400):
        errors.append(np.abs(DmpPlayer(cut_plan, step_share=1 / steps).step(end).position_m - exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 4) < [1.0, 0.6, 0.4])


def test_another_time_scale_midway_leaves_the_path(plan: MotionPlan) -> None:
    player = DmpPlayer(plan)
    half = plan.duration_s / 2
    first = [player.step(half / 50) for _ in range(50)]
    second = [player.step(half / 50, tau_scale=2.0) for _ in range(100)]
    shares = np.array([one.share for one in first + second])
    truth = play(plan, shares * plan.duration_s)
    assert shares[49] == pytest.approx(0.5)
    assert shares[-1] == pytest.approx(1.0)
    assert np.abs([one.position_m for one in first + second] - truth.position_m).max() < 1e-8
    assert np.abs(np.array([one.velocity_m_s for one in second]) - truth.velocity_m_s[50:] / 2).max() < 1e-6


def test_a_changed_goal_is_reached_without_a_jump_of_the_acceleration(plan: MotionPlan) -> None:
    player = DmpPlayer(plan)
    run(player, plan.duration_s / 2)
    before = player.now.acceleration_m_s2
    goal = plan.goal_m + np.array([0.05, 0.0, -0.03])
    after = player.step(1e-4, goal_m=goal).acceleration_m_s2
    assert np.abs(after - before).max() < 0.5  # K dg / tau^2 at once would be 18 m/s^2
    run(player, 2 * plan.duration_s)
    assert np.abs(player.now.position_m - goal).max() < 1e-6


def test_the_motion_waits_for_a_cup_that_is_held_and_goes_on_when_it_is_let_go(plan: MotionPlan) -> None:
    player = DmpPlayer(plan, tolerance_m=0.01)
    run(player, 0.4 * plan.duration_s)
    held = player.now.position_m
    before = player.now.share
    for _ in range(200):
        player.step(0.01, measured_m=held)
    waited = player.now
    # in two seconds it would be over; the farther it is from the cup, the slower it goes
    assert waited.share - before < 0.3
    assert np.linalg.norm(waited.position_m - held) < 0.1
    assert np.linalg.norm(waited.velocity_m_s) < 0.03
    run(player, 3 * plan.duration_s)
    assert np.abs(player.now.position_m - plan.goal_m).max() < 1e-6


def test_waiting_leaves_the_path(plan: MotionPlan) -> None:
    player = DmpPlayer(plan, tolerance_m=0.02)
    lag = np.array([0.01, 0.0, 0.01])
    steps = [player.step(0.01, measured_m=player.now.position_m - lag) for _ in range(150)]
    truth = play(plan, np.array([one.share for one in steps]) * plan.duration_s).position_m
    assert np.abs([one.position_m for one in steps] - truth).max() < 1e-8


def test_without_an_error_nothing_slows_down(plan: MotionPlan) -> None:
    free, watched = DmpPlayer(plan), DmpPlayer(plan)
    for _ in range(100):
        free.step(0.01)
        watched.step(0.01, measured_m=watched.now.position_m)
    assert np.array_equal(free.now.position_m, watched.now.position_m)


def test_the_hold_does_not_drift_in_an_hour(cut_plan: MotionPlan) -> None:
    player = DmpPlayer(cut_plan)
    run(player, 2 * cut_plan.duration_s)
    rest = player.now.position_m
    for _ in range(20):
        player.step(0.5)
    assert np.abs(player.now.position_m - rest).max() < 1e-9
    assert np.abs(player.now.velocity_m_s).max() < 1e-9


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_times_and_scales_that_are_none_are_refused(plan: MotionPlan, value: float) -> None:
    with pytest.raises(ValueError, match="dt_s must be positive and finite, not"):
        DmpPlayer(plan).step(value)
    with pytest.raises(ValueError, match="tau_scale must be positive and finite, not"):
        DmpPlayer(plan).step(0.01, tau_scale=value)
