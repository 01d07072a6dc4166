"""States of the robot for virtual cameras."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.control.scene_history import HANDLE_END_M, KEPT_PERIODS, SceneHistory, joint_places
from kendama_cli.devices.robot.interface import JointCommand, SceneState
from kendama_cli.devices.robot.simulated import SimulatedRobot
from tests.devices.robot.test_simulated import WORN
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

ORIGIN_M = np.array([0.5, 0.0, 1.0])


def moving(t_s: float) -> SceneState:
    ball = np.array([1.0 + 2.0 * t_s, 0.0, 1.5 - t_s])
    return SceneState(np.array([t_s]), np.array([t_s, 0.0, 1.0]), np.eye(3), ball)


def recorded(until: int) -> SceneHistory:
    history = SceneHistory(lambda q: np.array([[q[0], 0.0, 0.0]]), 0.4, ORIGIN_M)
    for k in range(until):
        history.add(0.004 * k, moving(0.004 * k))
    return history


@pytest.mark.parametrize("t_s", [0.0, 0.0013, 0.004, 0.0181, 0.036])
def test_between_two_periods_everything_moves_straight(t_s: float) -> None:
    pose = recorded(10)(t_s)
    assert pose.ball_m == pytest.approx(moving(t_s).ball_m - ORIGIN_M)
    assert pose.cup_m == pytest.approx(moving(t_s).cup_m - ORIGIN_M)
    assert pose.arm_m[0] == pytest.approx(np.array([t_s, 0.0, 0.0]) - ORIGIN_M)


def test_a_cup_turns_evenly_between_two_periods_and_a_rollout_is_all_that_was_added() -> None:
    history = SceneHistory(lambda q: np.array([[q[0], 0.0, 0.0]]), 0.4, ORIGIN_M)
    turns = Rotation.from_rotvec(np.outer(np.arange(KEPT_PERIODS + 9), [0.02, -0.03, 0.01]))
    for k, turn in enumerate(turns):
        scene = moving(0.004 * k)
        history.add(7.0 + 0.004 * k, SceneState(scene.position_rad, scene.cup_m, turn.as_matrix(), scene.ball_m))
    pose, here = history(7.0 + 0.004 * 40.25), Rotation.from_rotvec(40.25 * np.array([0.02, -0.03, 0.01])).as_matrix()
    assert pose.cup_rotation == pytest.approx(here, abs=1e-6)
    assert pose.arm_m[-1] == pytest.approx(pose.cup_m - HANDLE_END_M * here[:, 2], abs=1e-6)
    assert history.position_rad(7.0 + 0.004 * 40.25) == pytest.approx([0.004 * 40.25])
    path = history.rollout()
    assert path[:, 0] == pytest.approx(0.004 * np.arange(KEPT_PERIODS + 9))
    assert path[:, 4:7] == pytest.approx(turns.as_matrix()[:, :, 2])
    assert path[11, [1, 3, 7, 9]] == pytest.approx([0.044, 1.0, 1.088, 1.456])


def test_before_and_after_what_is_known_the_scene_is_held() -> None:
    history = recorded(KEPT_PERIODS + 30)
    first, last = 0.004 * 30, 0.004 * (KEPT_PERIODS + 29)
    assert history(first - 0.01).cup_m == pytest.approx(moving(first).cup_m - ORIGIN_M)
    assert history(last + 0.01).cup_m == pytest.approx(moving(last).cup_m - ORIGIN_M)
    assert history.reported
    history.clear()
    assert not history.reported


def test_the_scene_is_where_the_arm_truly_is_without_the_noise_of_what_is_read() -> None:
    robot = SimulatedRobot(bench_arm(), kendama_game(), imperfection=WORN, control_period_s=0.004)
    arm = modelled(bench_arm())
    home = np.array(bench_arm().home_rad)
    robot.reset(home, 3)
    ball_noise = []
    for _ in range(100):
        exchange = robot.exchange(JointCommand(home, np.zeros(7), np.zeros(7)))
        scene = exchange.scene
        assert scene is not None
        assert scene.cup_m == pytest.approx(arm.tool_position_m(scene.position_rad), abs=1e-9)
        assert scene.cup_rotation.T @ scene.cup_rotation == pytest.approx(np.eye(3))
        ball_noise.append(exchange.state.ball_in_world_m - scene.ball_m)
    assert np.std(ball_noise) == pytest.approx(WORN.ball_noise_m, rel=0.2)
    places = functools.partial(joint_places, arm)(home)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).min() > 0.01, "a shared origin is given once"
    elsewhere = joint_places(arm, home + 0.3)
    assert np.linalg.norm(np.diff(elsewhere, axis=0), axis=1) == pytest.approx(
        np.linalg.norm(np.diff(places, axis=0), axis=1)
    ), "links are rigid"
    assert np.linalg.norm(places[-1] - arm.tool_position_m(home)) < 0.3, "the hand is near the cup"


def test_the_rope_is_seen_to_begin_where_it_is_tied_to_the_cup() -> None:
    """A tie on the wall of a cup that leans by a quarter turn about y: what was along x points down."""
    history = SceneHistory(lambda q: np.empty((0, 3)), 0.4, ORIGIN_M, (0.049, 0.0, 0.015))
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    history.add(0.0, SceneState(np.zeros(1), np.array([1.0, 0.0, 1.0]), turn, np.array([1.0, 0.0, 0.6])))
    assert history(0.0).rope_m[0] == pytest.approx(np.array([1.015, 0.0, 0.951]) - ORIGIN_M)
