"""The visual catch against the same motion as planned, in simulated rollouts."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from kendama_cli.adaptation.search_record import Perturbation
from kendama_cli.control.visual_catch import VisualCatch
from kendama_cli.simulation.dart.arm_errors import ArmErrors, WorldErrors
from kendama_cli.simulation.dart.rollout import RolloutResult, play_rollout
from kendama_cli.simulation.dart.world import ArmWorld
from tests.control.seen_swings import ADAPT, swing
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

HARSH = Perturbation(WorldErrors(rope_scale=1.005, drag_scale=2.0), ArmErrors(0.03, 0.005, 1.5, 0.5), 0)
"""Twice the drag, an arm 30 ms behind, a cup 5 mm off: the ball comes down far beside the plan."""


@functools.cache
def rollout(*, seen: bool, max_sigma_m: float = ADAPT.correction.max_sigma_m) -> RolloutResult:
    """The swing in a harsh world."""
    made, world = swing(), ArmWorld(bench_arm(), kendama_game())
    correction = dataclasses.replace(ADAPT.correction, max_sigma_m=max_sigma_m)
    rng = np.random.default_rng(10000)
    eyes = VisualCatch(
        made.arm, kendama_game(), made.joints, made.cup, sensor=ADAPT.sensor_model, correction=correction, rng=rng
    )
    world.perturb(HARSH.world)
    return play_rollout(world, made.joints, errors=HARSH.arm, correction=eyes if seen else None, record=True)


def test_what_the_plan_misses_far_is_caught_when_it_is_seen() -> None:
    as_planned, seen = rollout(seen=False), rollout(seen=True)
    assert not as_planned.caught
    assert abs(as_planned.signed_miss_m or 1.0) > 0.05
    assert seen.caught
    assert abs(seen.signed_miss_m or 1.0) < 0.02


def test_a_sensor_that_is_never_trusted_changes_nothing() -> None:
    blind, as_planned = rollout(seen=True, max_sigma_m=1e-9), rollout(seen=False)
    assert blind.trace is not None
    assert as_planned.trace is not None
    assert blind.trace.ball_m.tobytes() == as_planned.trace.ball_m.tobytes()


def test_before_the_rope_slackens_the_swing_is_the_planned_one() -> None:
    as_planned, seen = rollout(seen=False), rollout(seen=True)
    assert as_planned.trace is not None
    assert seen.trace is not None
    assert as_planned.flight_s is not None
    before = seen.trace.t_s < as_planned.flight_s[0] - 0.02
    assert before.sum() > 100
    assert (seen.trace.cup_m[before] == as_planned.trace.cup_m[before]).all()
