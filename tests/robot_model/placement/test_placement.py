from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.errors import StageError
from kendama_cli.robot_model.inverse_kinematics import solve_cup
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.motion_check import limit_ratios, require_within_limits
from kendama_cli.robot_model.placement.placement import CupLine, cup_line, joint_trajectory
from tests.simulation.dart.bench_robot import bench_arm, frictionless_bench_arm, kendama_game, modelled


@pytest.fixture(scope="module")
def line() -> CupLine:
    return cup_line(bench_arm(), kendama_game(), 0.4)


@pytest.fixture(scope="module")
def arm() -> RobotModel:
    return modelled(bench_arm())


def test_the_cup_stays_upright_and_on_its_line(line: CupLine, arm: RobotModel) -> None:
    for x in np.linspace(-0.4, 0.4, 37):
        value, _ = arm.cup_task(line.at(float(x), 0.0, 0.0).position_rad)
        # between two knots of 5 mm the spline's error is below 1e-7 m
        assert np.abs(value[:3] - line.home_m - [x, 0.0, 0.0]).max() < 1e-7
        assert np.abs(value[3:]).max() < 1e-7


def test_the_lines_speeds_and_accelerations_are_those_of_its_positions(line: CupLine) -> None:
    x, v, a, h = 0.123, 1.5, -6.0, 1e-4
    positions = [line.at(x + v * t + a * t * t / 2, 0.0, 0.0).position_rad for t in (-h, 0.0, h)]
    point = line.at(x, v, a)
    assert point.velocity_rad_s == pytest.approx((positions[2] - positions[0]) / (2 * h), abs=1e-5)
    assert point.acceleration_rad_s2 == pytest.approx((positions[2] - 2 * positions[1] + positions[0]) / h**2, abs=1e-2)


def test_the_jacobian_turns_the_lines_joint_speeds_into_the_cups_speed(line: CupLine, arm: RobotModel) -> None:
    point = line.at(-0.2, 1.0, 0.0)
    _, jacobian = arm.cup_task(point.position_rad)
    assert jacobian @ point.velocity_rad_s == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0], abs=1e-6)


def test_the_line_begins_at_home(line: CupLine) -> None:
    assert np.abs(line.at(0.0, 0.0, 0.0).position_rad - line.home_rad).max() < 1e-6


@pytest.mark.parametrize(("speed_m_s", "change_m_s2", "can"), [(2.0, 8.0, True), (4.0, 30.0, False)])
def test_the_arm_can_run_the_line_at_the_speed_that_learning_uses(
    line: CupLine, arm: RobotModel, speed_m_s: float, change_m_s2: float, can: bool
) -> None:
    """Toward the ends the speed falls to what this acceleration can still brake within the line."""
    worst = 0.0
    for x in np.linspace(-line.half_width_m, line.half_width_m, 201):
        running = min(speed_m_s, np.sqrt(2 * change_m_s2 * (line.half_width_m - abs(x))))
        for change in (-change_m_s2, change_m_s2):
            point = line.at(x, running, change)
            worst = max(worst, np.abs(point.velocity_rad_s / arm.limits.velocity_rad_s).max())
            worst = max(worst, np.abs(point.acceleration_rad_s2 / arm.limits.acceleration_rad_s2).max())
    assert (worst < 1.0) == can


def test_leaving_the_line_is_refused(line: CupLine) -> None:
    with pytest.raises(StageError, match=r"x = 0\.450 m; allowed: \+-0\.400 m"):
        line.at(0.45, 0.0, 0.0)
    with pytest.raises(StageError, match="x = nan"):
        line.at(float("nan"), 0.0, 0.0)


def test_a_place_out_of_reach_is_refused(arm: RobotModel) -> None:
    with pytest.raises(StageError, match=r"pa10 cannot hold the cup upright at x 3\.0, y 0\.0, z 1\.2 m"):
        solve_cup(arm, np.array([3.0, 0.0, 1.2]), arm.home_rad)


def test_a_path_that_ends_at_a_joints_stop_names_the_joint_and_its_limit(arm: RobotModel) -> None:
    far = np.linspace(0.0, 1.0, 60)[:, None] * [0.0, 0.0, -0.75]
    with pytest.raises(StageError, match=r"pa10 (would need|cannot hold) .* at \d\.\d\d s"):
        joint_trajectory(arm, np.linspace(0.0, 5.0, 60), far)


def test_a_trajectory_holds_the_cup_upright_on_its_path(arm: RobotModel) -> None:
    t_s = np.linspace(0.0, 2.0, 401)
    cup_m = np.column_stack([0.25 * np.sin(3 * t_s) ** 2, 0 * t_s, 0.2 * np.sin(2 * t_s) ** 2])
    joints = joint_trajectory(arm, t_s, cup_m)
    for i in range(0, 401, 40):
        value, jacobian = arm.cup_task(joints.position_rad[i])
        assert np.abs(value - [*(arm.tool_position_m(arm.home_rad) + cup_m[i]), 0, 0]).max() < 1e-8
        speed = [0.75 * np.sin(6 * t_s[i]), 0.0, 0.4 * np.sin(4 * t_s[i]), 0.0, 0.0]
        if i > 0:  # at its ends a spline's speed is less exact
            assert jacobian @ joints.velocity_rad_s[i] == pytest.approx(speed, abs=1e-3)
    assert require_within_limits(arm, joints).velocity.max() < 1.0


def test_shares_scale_with_tempo_as_speed_and_acceleration_do_and_efforts_tend_to_the_weight() -> None:
    arm = RobotModel(
        dataclasses.replace(frictionless_bench_arm(), stribeck_nm=(0.0,) * 7),
        kendama_game().cup,
        kendama_game().gravity_m_s2,
    )
    path = np.linspace(0.0, 2.0, 401)
    cup_m = np.column_stack([0.25 * np.sin(3 * path) ** 2, 0 * path, 0.2 * np.sin(2 * path) ** 2])
    one, slow, still = (limit_ratios(arm, joint_trajectory(arm, factor * path, cup_m)) for factor in (1.0, 2.0, 1e4))
    assert 2 * slow.velocity == pytest.approx(one.velocity)
    assert 4 * slow.acceleration == pytest.approx(one.acceleration)
    weights = []
    for posture in joint_trajectory(arm, path, cup_m).position_rad:
        weights.append(np.abs(arm.rigid_effort_nm(posture, np.zeros(7), np.zeros(7))) / arm.limits.effort_nm)
    assert still.effort == pytest.approx(np.max(weights, axis=0), abs=1e-5)
    assert (still.to_stop_rad == one.to_stop_rad).all()
    assert [lead.kind for lead in one.leading] == sorted(
        ("speed", "acceleration", "effort"),
        key=lambda kind: -{"speed": one.velocity, "acceleration": one.acceleration, "effort": one.effort}[kind].max(),
    )


def test_redundancy_weights_hold_a_joint_back(arm: RobotModel) -> None:
    heavy = list(arm.redundancy_weights)
    heavy[2] *= 1e4
    held = RobotModel(
        dataclasses.replace(arm.settings, redundancy_weights=tuple(heavy)),
        kendama_game().cup,
        kendama_game().gravity_m_s2,
    )
    t_s = np.linspace(0.0, 1.0, 41)
    path = np.linspace(0.0, 0.25, 41)[:, None] * [1.0, 0.0, 0.0]
    free, still = joint_trajectory(arm, t_s, path).position_rad, joint_trajectory(held, t_s, path).position_rad
    assert abs(still[-1, 2] - still[0, 2]) < 0.1 * abs(free[-1, 2] - free[0, 2])


def test_a_motion_that_is_too_fast_names_the_joint_and_its_limit(arm: RobotModel) -> None:
    t_s = np.linspace(0.0, 0.4, 401)
    with pytest.raises(StageError, match=r"joint '\w+' of pa10 would need [\d.]+ (rad/s|rad/s\^2|Nm); allowed: [\d.]+"):
        require_within_limits(arm, joint_trajectory(arm, t_s, 0.3 * np.sin(8 * t_s)[:, None] ** 2 * [1.0, 0.0, 0.0]))
