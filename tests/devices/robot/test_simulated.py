from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from contextlib import closing

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.devices.robot.limiter import limit_command
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.errors import HardwareError
from kendama_cli.plugins.suites.robot import CHECKS, OpenRobot, check_halt, check_limits
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.robot import Imperfection
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

PERFECT = Imperfection(
    rope_scale=1.0,
    rope_scale_spread=0.0,
    ball_start_m=0.0,
    joint_friction_nm=0.0,
    joint_friction_fraction=0.0,
    lag_s=0.0,
    latency_s=0.0,
    joint_noise_rad=0.0,
    ball_noise_m=0.0,
    mass_scale=1.0,
    drag_scale=1.0,
    tie_friction_m=0.0,
    gravity_tilt_rad=0.0,
    backlash_rad=0.0,
    drift_m=0.0,
    drift_s=0.3,
    tracking_delay_s=0.0,
    tracking_lost_fraction=0.0,
)
WORN = dataclasses.replace(
    PERFECT,
    rope_scale=1.05,
    rope_scale_spread=0.01,
    ball_start_m=0.01,
    joint_friction_nm=0.3,
    joint_friction_fraction=0.1,
    lag_s=0.02,
    latency_s=0.01,
    joint_noise_rad=0.0005,
    ball_noise_m=0.001,
)


def _robot(imperfection: Imperfection | None = None, period_s: float = 0.004) -> SimulatedRobot:
    return SimulatedRobot(bench_arm(), kendama_game(), imperfection=imperfection, control_period_s=period_s)


def _nod(robot: Robot, seed: int = 0, periods: int = 100) -> list[Exchange]:
    """The wrist goes over to 0.2 rad and back, well within the limits."""
    home = np.array(bench_arm().home_rad)
    seen = [robot.reset(home, seed)]
    for k in range(1, periods + 1):
        t = k * robot.period_s
        wrist = np.array([0, 0, 0, 0, 0, 1.0, 0])
        turn = 0.1 * (1 - np.cos(8 * t)), 0.8 * np.sin(8 * t), 6.4 * np.cos(8 * t)
        seen.append(robot.exchange(JointCommand(home + turn[0] * wrist, turn[1] * wrist, turn[2] * wrist)))
    return seen


@pytest.mark.parametrize("imperfection", [None, WORN], ids=["perfect", "worn"])
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_simulated_robot_keeps_the_laws_of_the_interface(
    check: Callable[[OpenRobot], None], imperfection: Imperfection | None
) -> None:
    check(lambda: closing(_robot(imperfection)))


def test_the_laws_catch_a_robot_that_ignores_its_limits() -> None:
    class Reckless(SimulatedRobot):
        def exchange(self, command: JointCommand) -> Exchange:
            made = super().exchange(command)
            return dataclasses.replace(made, sent=command)

    with pytest.raises(AssertionError, match="broken law: what is sent keeps to the position limits"):
        check_limits(lambda: closing(Reckless(bench_arm(), kendama_game(), imperfection=None, control_period_s=0.004)))


def test_the_laws_catch_a_robot_that_continues_after_a_halt() -> None:
    class Restless(SimulatedRobot):
        def halt(self) -> None:
            pass

    with pytest.raises(AssertionError, match="broken law: a halted robot refuses"):
        check_halt(lambda: closing(Restless(bench_arm(), kendama_game(), imperfection=None, control_period_s=0.004)))


def test_a_perfect_robot_follows_within_a_milliradian() -> None:
    for exchange in _nod(_robot()):
        assert np.abs(exchange.state.position_rad - exchange.sent.position_rad).max() < 1e-3


def test_an_imperfection_of_nothing_changes_nothing() -> None:
    for one, other in zip(_nod(_robot()), _nod(_robot(PERFECT)), strict=True):
        assert np.array_equal(one.state.position_rad, other.state.position_rad)
        assert np.array_equal(one.state.ball_in_world_m, other.state.ball_in_world_m)


@pytest.mark.parametrize(
    ("late", "delay_s"), [({"latency_s": 0.02}, 0.020), ({"lag_s": 0.02}, 0.020)], ids=["latency", "lag"]
)
def test_latency_and_lag_bring_the_motion_late_by_that_much(late: dict[str, float], delay_s: float) -> None:
    prompt = np.array([one.state.position_rad[5] for one in _nod(_robot(period_s=0.001), periods=600)])
    slow = np.array(
        [one.state.position_rad[5] for one in _nod(_robot(dataclasses.replace(PERFECT, **late), 0.001), periods=600)]
    )
    shift = int(delay_s / 0.001)
    rest = np.abs(slow[100 + shift :] - prompt[100:-shift]).max()
    # a first-order lag delays an 8 rad/s motion by atan(8 lag) / 8, 0.2 ms less, and damps it by 1.3 %
    assert rest < 3e-3
    assert np.abs(slow - prompt).max() > 5 * rest


def test_noise_is_drawn_from_the_seed_alone() -> None:
    robot = _robot(WORN)
    first, again, other = _nod(robot, seed=1), _nod(robot, seed=1), _nod(robot, seed=2)
    assert np.array_equal(first[-1].state.ball_in_world_m, again[-1].state.ball_in_world_m)
    assert not np.array_equal(first[-1].state.ball_in_world_m, other[-1].state.ball_in_world_m)


def test_a_longer_rope_lets_the_ball_hang_lower() -> None:
    plain = _robot().reset(np.array(bench_arm().home_rad), 0).state
    long = _robot(dataclasses.replace(PERFECT, rope_scale=1.1)).reset(np.array(bench_arm().home_rad), 0).state
    assert plain.ball_in_world_m[2] - long.ball_in_world_m[2] == pytest.approx(0.04, abs=1e-9)


def test_the_wrists_sensor_carries_the_tool_and_the_ball() -> None:
    game = kendama_game()
    robot = _robot()
    last = robot.reset(np.array(bench_arm().home_rad), 0)
    for _ in range(50):
        last = robot.exchange(dataclasses.replace(last.sent))
    weight_n = (game.cup.mass_kg + game.ball.mass_kg) * game.gravity_m_s2
    assert np.linalg.norm(last.state.wrist_wrench[:3]) == pytest.approx(weight_n, rel=1e-3)


def test_an_added_effort_is_clipped_to_the_limit_and_passes_latency_as_the_command_does() -> None:
    robot = _robot(dataclasses.replace(PERFECT, latency_s=0.02))
    home = robot.reset(np.array(bench_arm().home_rad), 0)
    push = np.array([0, 0, 0, 0, 0, 0, 1e6])
    moved = [robot.exchange(dataclasses.replace(home.sent, effort_nm=push)) for _ in range(10)]
    assert np.array_equal(moved[0].sent.effort_nm, np.clip(push, 0, robot.limits.effort_nm))
    turn = [abs(one.state.position_rad[6] - home.state.position_rad[6]) for one in moved]
    assert max(turn[:5]) < 1e-6 < turn[-1]


@pytest.mark.parametrize("bad", [np.full(7, np.nan), np.zeros(3)], ids=["nan", "three joints"])
def test_a_command_that_makes_no_sense_halts_the_robot(bad: Array) -> None:
    robot = _robot()
    with pytest.raises(
        HardwareError, match=r"velocity_rad_s is .* allowed: 7 finite numbers of at most .*: the robot halts"
    ):
        robot.exchange(JointCommand(np.zeros(7), bad, np.zeros(7)))
    with pytest.raises(HardwareError, match="is halted and stays so"):
        robot.exchange(JointCommand(np.zeros(7), np.zeros(7), np.zeros(7)))


def test_an_effort_that_is_not_finite_halts_the_robot() -> None:
    robot = _robot()
    with pytest.raises(
        HardwareError, match=r"effort_nm is .*nan.* allowed: 7 finite numbers of at most .*: the robot halts"
    ):
        robot.exchange(JointCommand(np.zeros(7), np.zeros(7), np.zeros(7), np.full(7, np.nan)))


LIMITS = JointLimits(np.array([-1.0]), np.array([1.0]), np.array([2.0]), np.array([10.0]), np.array([50.0]))
wild = st.floats(-100.0, 100.0)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(wild, wild, wild), min_size=30, max_size=60))
def test_the_limiter_keeps_every_limit_and_never_needs_to_break_harder_than_it_may(
    wanted: list[tuple[float, float, float]],
) -> None:
    period_s = 0.004
    last = JointCommand(np.zeros(1), np.zeros(1), np.zeros(1))
    for q, v, a in itertools.chain(wanted, [(5.0, 50.0, 0.0)] * 400, [(-5.0, -50.0, 0.0)] * 400):
        sent = limit_command(last, JointCommand(np.array([q]), np.array([v]), np.array([a])), LIMITS, period_s)
        assert abs(sent.position_rad[0]) <= 1.0
        assert abs(sent.velocity_rad_s[0]) <= 2.0 + 1e-9
        assert abs(sent.velocity_rad_s[0] - last.velocity_rad_s[0]) <= 10.0 * period_s + 1e-9
        last = sent
    assert last.position_rad[0] < -0.9


def test_a_feasible_command_passes_the_limiter_unchanged() -> None:
    last = JointCommand(np.zeros(1), np.array([0.5]), np.zeros(1))
    wanted = JointCommand(np.array([0.5 * 0.004 + 5 * 0.004**2 / 2]), np.array([0.52]), np.array([5.0]))
    sent = limit_command(last, wanted, LIMITS, 0.004)
    for name in ("position_rad", "velocity_rad_s", "acceleration_rad_s2"):
        assert np.array_equal(getattr(sent, name), getattr(wanted, name))
