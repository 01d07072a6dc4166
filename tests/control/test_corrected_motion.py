"""The cup beside its plan: where it meets the ball, what the joints may, and when it stays as planned."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import brentq

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.control.corrected_motion import CorrectedMotion, CupPlan, bounded, brakable, shortened
from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.schema.arrays import Array
from tests.control.seen_swings import ADAPT, swing
from tests.simulation.dart.bench_robot import kendama_game

RIM_M = kendama_game().cup.rim_m
LEVER_M = RIM_M - ADAPT.correction.below_rim_m
H = 0.004
SEEN_AT, CATCH_S = 600, 2.8
"""The sample of the plan from which the ball is seen, and when it comes down."""


def ball(beside_m: tuple[float, float], sigma_m: float = 0.001) -> CatchPose:
    """A ball that comes down ``beside_m`` the planned cup with 0.3 m/s to the side."""
    cup, _ = swing().cup.at(CATCH_S, LEVER_M)
    return CatchPose(
        t_s=CATCH_S,
        position_m=cup + np.array([*beside_m, 0.0]),
        velocity_m_s=np.array([0.3, 0.0, -2.0]),
        covariance_m2=np.eye(3) * sigma_m**2 / 3,
        time_sigma_s=0.001,
        rotation_wxyz=np.array([1.0, 0.0, 0.0, 0.0]),
        n_observations=30,
    )


def played(pose: CatchPose, **settings: float) -> tuple[CorrectedMotion, list[JointCommand]]:
    """Every command of a motion in which the ball is seen from sample SEEN_AT on."""
    plan = swing().cup
    motion = CorrectedMotion(plan, dataclasses.replace(ADAPT.correction, **settings), RIM_M)
    commands = [motion.last]
    while len(commands) < len(plan.motion.t_s) + 150:
        if len(commands) >= SEEN_AT and not motion.over:
            motion.follow(pose)
        commands.append(motion.next())
    return motion, commands


def mouth(position_rad: Array) -> Array:
    """Where the middle of the mouth is meant to meet the ball."""
    pose = swing().arm.tool_pose(position_rad)
    return np.asarray(pose.position_m + LEVER_M * pose.rotation[:, 2])


def test_until_a_ball_is_believed_the_motion_is_the_plan() -> None:
    _, commands = played(ball((0.1, 0.0), sigma_m=0.1))
    motion = swing().cup.motion
    planned = commands[: len(motion.t_s)]
    assert (np.array([one.position_rad for one in planned]) == motion.position_rad).all()
    assert (np.array([one.velocity_rad_s for one in planned]) == motion.velocity_rad_s).all()
    assert (np.array([one.acceleration_rad_s2 for one in planned]) == motion.acceleration_rad_s2).all()


@pytest.mark.parametrize("beside_m", [(0.08, 0.0), (-0.1, 0.02), (0.0, 0.0)])
def test_the_cup_meets_the_ball_where_and_when_it_comes_down_upright(beside_m: tuple[float, float]) -> None:
    pose = ball(beside_m)
    motion, commands = played(pose)
    meeting = commands[round(CATCH_S / H)].position_rad
    assert mouth(meeting)[:2] == pytest.approx(pose.position_m[:2], abs=1.5e-3)
    assert swing().arm.tool_pose(meeting).rotation[2, 2] == pytest.approx(1.0, abs=1e-6)
    # afterwards it comes to rest beside the plan
    assert not commands[-1].velocity_rad_s.any()
    assert np.linalg.norm(motion.shift_m - beside_m) < 0.05


def test_the_cup_gives_with_the_ball_at_the_catch_and_brakes_after_it() -> None:
    """At its planned height with 0.3 m/s down; then v^2 / 2a farther down, 22.5 mm at 2 m/s^2."""
    _, commands = played(ball((0.05, 0.0)), contact_speed_m_s=0.3, contact_braking_m_s2=2.0)
    plan, meeting = swing().cup, round(CATCH_S / H)
    lift = np.array([swing().arm.tool_position_m(one.position_rad)[2] for one in commands])
    lift -= [plan.sample(k).position_m[2] for k in range(len(commands))]
    assert lift[: SEEN_AT - 1] == pytest.approx(0.0, abs=1e-9)
    assert lift[SEEN_AT:meeting].max() == pytest.approx(4 / 27 * 0.3 * (CATCH_S - H * SEEN_AT), rel=0.05)
    assert lift[meeting] == pytest.approx(0.0, abs=2e-3)
    assert (lift[meeting] - lift[meeting - 2]) / (2 * H) == pytest.approx(-0.3, abs=0.03)
    assert lift[-1] - lift[meeting] == pytest.approx(-0.0225, abs=2e-3)


def test_a_late_drive_is_commanded_earlier() -> None:
    pose, late = ball((0.08, 0.0)), 5
    motion = CorrectedMotion(swing().cup, ADAPT.correction, RIM_M)
    commands = [motion.last]
    while len(commands) < 900:
        if len(commands) >= SEEN_AT:
            motion.follow(pose)
        commands.append(motion.next())
        motion.observe(commands[max(len(commands) - 1 - late, 0)].position_rad)
    assert motion.lag_s == pytest.approx(late * H, rel=0.03)
    assert mouth(commands[round(CATCH_S / H) - late].position_rad)[:2] == pytest.approx(pose.position_m[:2], abs=3e-3)


def test_every_command_keeps_to_the_joints_limits_and_goes_no_farther_than_allowed() -> None:
    motion, commands = played(ball((0.5, 0.3)), max_shift_m=0.2)
    limits = swing().arm.limits
    places = np.array([one.position_rad for one in commands])
    speeds = np.array([one.velocity_rad_s for one in commands])
    bends = np.abs(np.diff(speeds, axis=0)) / H
    assert (places >= limits.lower_rad).all()
    assert (places <= limits.upper_rad).all()
    assert (np.abs(speeds) <= limits.velocity_rad_s).all()
    assert (bends <= limits.acceleration_rad_s2 * (1 + 1e-9)).all()
    # places and speeds belong together: a step is the mean speed, to the third order of the period
    assert np.abs(np.diff(places, axis=0) - H * (speeds[1:] + speeds[:-1]) / 2).max() < 1e-4
    # the place is bounded, and not the aim alone: 10 um is a last period of braking that is not whole
    beside = np.array([swing().arm.tool_position_m(one.position_rad) for one in commands])
    beside -= np.array([swing().cup.sample(k).position_m for k in range(len(commands))])
    assert np.linalg.norm(beside[:, :2], axis=1).max() < 0.2 + 1e-3
    assert motion.max_shift_m <= 0.2 + 2e-5
    assert 0.1 < motion.catch_shift_m <= motion.max_shift_m


@pytest.mark.parametrize("beside_m", [(0.05, 0.0), (-0.06, 0.05), (0.15, 0.1), (0.1, -0.2)])
@pytest.mark.parametrize("most_m", [0.08, 0.2])
def test_the_cup_brakes_in_time_for_a_ball_that_flies_fast_to_the_side(
    beside_m: tuple[float, float], most_m: float
) -> None:
    """Matched and then braked with 4 m/s^2, 1.5 m/s take 0.28 m."""
    fast = dataclasses.replace(ball(beside_m), velocity_m_s=np.array([*1.5 * np.sign(beside_m), -2.0]))
    motion, commands = played(fast, max_shift_m=most_m)
    shift = np.array([swing().arm.tool_position_m(one.position_rad) for one in commands])[:, :2]
    shift -= np.array([swing().cup.sample(k).position_m[:2] for k in range(len(commands))])
    assert np.linalg.norm(shift, axis=1).max() < most_m + 1e-3
    assert not commands[-1].velocity_rad_s.any()
    if np.hypot(*beside_m) < most_m - 0.02:
        meeting = commands[round(CATCH_S / H)].position_rad
        assert np.linalg.norm(mouth(meeting)[:2] - fast.position_m[:2]) < 0.01
    assert motion.max_shift_m <= most_m + 2e-5


def test_a_shift_is_bounded_by_where_it_would_stop_and_a_speed_by_the_way_that_is_left() -> None:
    """Random states: with the speed v the cup stops v |v| / 2b farther on, within the circle and 10 um."""
    rng, settings, kinds = np.random.default_rng(10008), ADAPT.correction, set()
    b, most = settings.braking_m_s2, settings.max_shift_m

    def stop(shift: Array, speed: Array) -> float:
        return float(np.linalg.norm(shift + speed * np.linalg.norm(speed) / (2 * b)))

    for _ in range(400):
        shift, speed, asked = (size * rng.normal(size=2) for size in (0.15, 0.6, 60.0))
        ends = shift + H * speed + 0.5 * H**2 * asked, speed + H * asked
        inside, leads = stop(shift, speed) <= most + 1e-5, stop(*ends) > most + 1e-5
        kinds.add((inside, leads))
        wanted = shortened(-speed / H, b if inside else settings.acceleration_m_s2) if leads else asked
        assert bounded(asked, shift, speed, H, settings) == pytest.approx(wanted)
        allowed = brakable(speed, shift, settings)
        assert allowed @ [-speed[1], speed[0]] == pytest.approx(0.0, abs=1e-12)
        if np.linalg.norm(shift) < most:
            assert stop(shift, allowed) == pytest.approx(min(most, stop(shift, speed)), abs=1e-9) or (
                np.allclose(allowed, speed) and stop(shift, speed) <= most
            )
    assert len(kinds) == 4
    assert not brakable(np.array([1.0, 0.0]), np.array([most + 0.01, 0.0]), settings).any()
    assert shortened(np.array([3.0, 4.0]), 1.0) == pytest.approx([0.6, 0.8])
    assert shortened(np.array([0.3, 0.4]), 1.0) == pytest.approx([0.3, 0.4])
    assert not shortened(np.zeros(2), 1.0).any()


def test_the_planned_cup_is_that_of_the_joints_and_on_straight_lines_between_samples() -> None:
    arm, cup, h = swing().arm, swing().cup, 1e-5
    for k in (0, 311, 640):
        rows = list(zip(cup.motion.position_rad[k : k + 2], cup.motion.velocity_rad_s[k : k + 2], strict=True))
        poses = [arm.tool_pose(q) for q, _ in rows]
        points = [one.position_m + 0.05 * one.rotation[:, 2] for one in poses]
        speeds = [(arm.tool_position_m(q + h * v) - arm.tool_position_m(q - h * v)) / (2 * h) for q, v in rows]
        for part in (0.0, 0.25):
            point, speed = cup.at((k + part + 1e-9) * H, 0.05)
            assert point == pytest.approx(points[0] + part * (points[1] - points[0]), abs=1e-7)
            assert speed == pytest.approx(speeds[0] + part * (speeds[1] - speeds[0]), abs=1e-6)


def test_a_ball_may_be_foreseen_at_any_height_of_its_flight() -> None:
    """A tenth of a second before it comes down, on the same parabola, it leads to the same commands."""
    down, early = ball((0.08, 0.03)), 0.1
    velocity = down.velocity_m_s + np.array([0.0, 0.0, early * 9.81])
    position = down.position_m - early * down.velocity_m_s - [0.0, 0.0, 0.5 * 9.81 * early**2]
    before = dataclasses.replace(down, t_s=CATCH_S - early, position_m=position, velocity_m_s=velocity)
    ours, theirs = (np.array([one.position_rad for one in played(pose)[1]]) for pose in (before, down))
    assert ours[: round(CATCH_S / H)] == pytest.approx(theirs[: round(CATCH_S / H)], abs=1e-6)


@pytest.mark.parametrize("lag_s", [0.0, 0.05])
@pytest.mark.parametrize("foreseen_s", [1.0, 1.3, 1.6, 1.9])
def test_the_catch_is_when_the_ball_comes_down_to_the_cup_that_the_late_drive_then_has(
    foreseen_s: float, lag_s: float
) -> None:
    """Reference: the root of its height over the plan, which goes up and down here."""
    cup = swing().cup
    motion = CorrectedMotion(cup, ADAPT.correction, RIM_M)
    for _ in range(round(foreseen_s / H) - 60):
        motion.next()
    motion._lag = cast("Any", SimpleNamespace(lag_s=lag_s))
    above = cup.at(foreseen_s, LEVER_M)[0] + [0.02, 0.0, 0.15]
    pose = dataclasses.replace(ball((0.0, 0.0)), t_s=foreseen_s, position_m=above)

    def over(s: float) -> float:
        return float(above[2] - 2.0 * s - 0.5 * 9.81 * s**2 - cup.at(foreseen_s + s - lag_s, LEVER_M)[0][2])

    motion.follow(pose)
    motion.next()
    assert motion._catch_s == pytest.approx(foreseen_s + brentq(over, 0.0, 0.3) - lag_s, abs=1e-6)


def test_no_ball_is_followed_before_the_time_from_which_it_may_be() -> None:
    motion = CorrectedMotion(swing().cup, ADAPT.correction, RIM_M, from_s=1.0)
    for _ in range(round(1.0 / H)):
        motion.follow(ball((0.08, 0.0)))
        motion.next()
    assert not motion.corrected
    motion.follow(ball((0.08, 0.0)))
    assert motion.corrected


def test_a_ball_out_of_reach_is_followed_no_farther_than_the_arm_can() -> None:
    motion, commands = played(ball((4.0, 0.0)), max_shift_m=5.0, acceleration_m_s2=100.0)
    assert 0.5 < motion.max_shift_m < 1.1  # it stops where the limits allow no way on
    limits = swing().arm.limits
    places = np.array([one.position_rad for one in commands])
    assert np.isfinite(places).all()
    assert (places >= limits.lower_rad).all()
    assert (places <= limits.upper_rad).all()
    # what a drive is asked for in one period is never absurd
    assert (np.abs(np.diff(places, axis=0)) <= 2.5 * H * limits.velocity_rad_s).all()


def test_a_plan_holds_its_last_posture() -> None:
    plan: CupPlan = swing().cup
    last = len(plan.motion.t_s) - 1
    assert plan.at(1e3, 0.0)[0] == pytest.approx(plan.sample(last).position_m)
