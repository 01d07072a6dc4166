"""The visual catch against the same motion as planned, in simulated rollouts."""

from __future__ import annotations

import dataclasses
import functools
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from kendama_cli.adaptation.perturbation import Perturbation
from kendama_cli.control.visual_catch import VisualCatch
from kendama_cli.simulation.dart.arm_errors import ArmErrors, WorldErrors
from kendama_cli.simulation.dart.rollout import RolloutResult, play_rollout
from kendama_cli.simulation.dart.world import ArmWorld
from tests.control.seen_swings import ADAPT, swing
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

HARSH = Perturbation(WorldErrors(rope_scale=1.005, drag_scale=2.0), ArmErrors(0.03, 0.005, 1.5, 0.5), 0)
"""Twice the drag, an arm 30 ms behind, a cup 5 mm off: the ball comes down far beside the plan."""


@functools.cache
def rollout(
    *,
    seen: bool,
    max_sigma_m: float = ADAPT.correction.max_sigma_m,
    contact_speed_m_s: float = 0.0,
    lag_s: float = 0.03,
) -> RolloutResult:
    """The swing in a harsh world."""
    made, world = swing(), ArmWorld(bench_arm(), kendama_game())
    correction = dataclasses.replace(ADAPT.correction, max_sigma_m=max_sigma_m, contact_speed_m_s=contact_speed_m_s)
    rng = np.random.default_rng(10000)
    eyes = VisualCatch(
        made.arm, kendama_game(), made.joints, made.cup, sensor=ADAPT.sensor_model, correction=correction, rng=rng
    )
    world.perturb(HARSH.world)
    return play_rollout(
        world,
        made.joints,
        errors=dataclasses.replace(HARSH.arm, lag_s=lag_s),
        correction=eyes if seen else None,
        record=True,
    )


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


def test_a_cup_that_gives_is_on_its_plan_at_the_contact_moves_down_and_brakes() -> None:
    """It ends lower by v^2 / 2 b."""
    speed_m_s = 0.3
    firm = rollout(seen=True, lag_s=0.0)
    giving = rollout(seen=True, contact_speed_m_s=speed_m_s, lag_s=0.0)
    assert giving.caught
    assert firm.trace is not None
    assert giving.trace is not None
    assert giving.flight_s is not None
    t_s = giving.trace.t_s
    dense = t_s > giving.flight_s[0]
    lift_m = np.interp(t_s[dense], giving.trace.t_s, giving.trace.cup_m[:, 2])
    lift_m = lift_m - np.interp(t_s[dense], firm.trace.t_s, firm.trace.cup_m[:, 2])
    contact = int(np.searchsorted(t_s[dense], giving.flight_s[1]))
    fall_m_s = -np.gradient(lift_m, t_s[dense])[contact : contact + 40]
    assert lift_m.max() > 0.008
    assert fall_m_s.max() == pytest.approx(speed_m_s, abs=0.05)
    assert lift_m[contact] == pytest.approx(0.0, abs=0.008)
    braking_m_s2 = ADAPT.correction.contact_braking_m_s2
    assert lift_m[-1] == pytest.approx(-(speed_m_s**2) / (2 * braking_m_s2), abs=0.002)


def looking() -> tuple[VisualCatch, list[tuple[float, float, np.ndarray, np.ndarray]]]:
    """A visual catch, and for each position that its tracker is given: now, its time, the ball and the tie point."""
    made = swing()
    eyes = VisualCatch(
        made.arm, kendama_game(), made.joints, made.cup, sensor=ADAPT.sensor_model, correction=ADAPT.correction,
        rng=np.random.default_rng(10025),
    )  # fmt: skip
    told: list[Any] = []
    tracker: Any = SimpleNamespace(found=None, waits=False, reset=told.clear, now_s=0.0)
    tracker.update = lambda *row: told.append((tracker.now_s, *row))
    eyes._tracker = tracker
    return eyes, told


def test_images_come_at_the_sensors_rate_and_late_with_the_tie_point_of_their_own_time() -> None:
    """The ball rises round a tie point that the arm moves; nothing is told while it is below the sensor's angle."""
    eyes, told = looking()
    sensor, joints, h = ADAPT.sensor_model, swing().cup.motion, 0.004
    at_rad = np.radians(sensor.observe_from_deg) + 2.0 * (h * np.arange(120) - 0.2)
    ties = np.array([swing().arm.tool_position_m(joints.position_rad[300 + k]) for k in range(120)])
    balls = ties + 0.4 * np.column_stack([np.sin(at_rad), 0 * at_rad, -np.cos(at_rad)])
    for k in range(120):
        cast("Any", eyes._tracker).now_s = h * k
        eyes.coming(h * k, joints.position_rad[300 + k], balls[k])
    frames = np.unique(np.ceil(np.arange(0.0, 120 * h, 1 / sensor.rate_hz) / h - 1e-6).astype(int))
    frames = frames[(frames >= 50) & (h * frames + sensor.latency_s <= 119 * h + 1e-9)]
    assert [stamp for _, stamp, _, _ in told] == pytest.approx(h * frames)
    assert [now for now, *_ in told] == pytest.approx(h * np.ceil((h * frames + sensor.latency_s) / h - 1e-6))
    assert np.array([tie for *_, tie in told]) == pytest.approx(ties[frames])
    noise = (np.array([ball for _, _, ball, _ in told]) - balls[frames]) / sensor.sigma_m
    assert np.abs(noise).max() < 4.5
    assert noise.std() == pytest.approx(1.0, rel=0.25)


def test_between_two_readings_the_tie_point_is_on_the_straight_line() -> None:
    eyes, _ = looking()
    eyes._ties.extend((float(k), np.array([k * k, 0.0, 1.0])) for k in range(4))
    x = [float(eyes._tie_at(at)[0]) for at in (-1.0, 0.25, 1.0, 1.5, 2.5, 9.0)]
    assert x[1:] == pytest.approx([0.25, 1.0, 2.5, 6.5, 9.0])
