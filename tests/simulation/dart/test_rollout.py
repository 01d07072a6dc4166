from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.averaging import encode_demonstrations
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.simulation.catch.late_shift import shifted_plan
from kendama_cli.simulation.dart.rollout import RolloutResult, play_rollout
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.simulation.dart.world_errors import NO_ERRORS, WorldErrors
from tests.motion.swings import settings as encode_settings
from tests.simulation.dart.bench_robot import ROOT, kendama_game, pa10


@pytest.fixture(scope="module")
def plan() -> MotionPlan:
    rows = np.loadtxt(ROOT / "data/demonstrations/swing-04.csv", delimiter=",", skiprows=3)
    swing = Demonstration("swing", rows[:, 0], rows[:, 1:4] - rows[0, 1:4])
    return encode_demonstrations([swing], encode_settings())


@pytest.fixture(scope="module")
def world() -> ArmWorld:
    return ArmWorld(pa10(), kendama_game())


def _play(world: ArmWorld, plan: MotionPlan, tau: float) -> RolloutResult:
    return play_rollout(world, ArmMotion(world.arm, plan, 5.0).joints(tau, 0.6))


def test_the_flight_is_the_time_in_which_the_rope_is_slack_before_the_ball_comes_down(
    world: ArmWorld, plan: MotionPlan
) -> None:
    world.perturb(NO_ERRORS)
    swing = ArmMotion(world.arm, plan, 5.0)
    result = play_rollout(world, swing.joints(1.0, 0.6), record=True)
    assert result.flight_s is not None
    assert result.trace is not None
    start, end = result.flight_s
    t_s, apart_m = result.trace.t_s, np.linalg.norm(result.trace.ball_m - result.trace.cup_m, axis=1)
    flying = (t_s > start) & (t_s < end)
    assert (apart_m[flying] < world.ball.game.rope.length_m).all()
    # a ball that rises 0.25 m over the rim and falls back needs 0.45 s
    assert 0.2 < end - start < 0.7
    # what rises freely falls with gravity: the ball's second difference is -g, but for the drag of the air
    fall = np.diff(result.trace.ball_m[flying, 2], 2) / 0.01**2
    assert fall == pytest.approx(-world.ball.game.gravity_m_s2, abs=0.2)


def test_moving_the_goal_while_the_ball_flies_moves_the_miss_by_as_much(world: ArmWorld, plan: MotionPlan) -> None:
    """What the encoder's functions leave over of the step before the flight is some percent of it."""
    world.perturb(NO_ERRORS)
    tau = 1.08
    before = _play(world, plan, tau)
    assert before.flight_s is not None
    assert before.signed_miss_m is not None
    flight = (before.flight_s[0] / tau / plan.duration_s, before.flight_s[1] / tau / plan.duration_s)
    after = _play(world, shifted_plan(plan, (before.signed_miss_m, 0.0), flight), tau)
    assert abs(before.signed_miss_m) > 0.06
    assert abs(after.signed_miss_m or 1.0) < 0.25 * abs(before.signed_miss_m)
    assert not before.caught
    assert after.caught


def test_the_joint_that_came_nearest_to_its_torque_limit_is_named(world: ArmWorld, plan: MotionPlan) -> None:
    world.perturb(NO_ERRORS)
    result = _play(world, plan, 1.0)
    assert result.effort_joint in world.arm.joint_names
    assert 0.1 < result.effort_share <= 1.0


def test_a_rope_longer_than_thought_changes_the_miss_and_nothing_of_it_remains(
    world: ArmWorld, plan: MotionPlan
) -> None:
    world.perturb(NO_ERRORS)
    first = _play(world, plan, 1.0)
    world.perturb(WorldErrors(rope_scale=1.005, restitution=0.4))
    assert _play(world, plan, 1.0).signed_miss_m != pytest.approx(first.signed_miss_m, abs=0.002)
    world.perturb(NO_ERRORS)
    assert _play(world, plan, 1.0).signed_miss_m == first.signed_miss_m
