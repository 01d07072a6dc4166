"""The compiled chain against DART: the same places, the same way along a path, the same torques."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.robot_model.body import heading_turn
from kendama_cli.robot_model.chain import compiled_chain
from kendama_cli.robot_model.chain_kernel import Curve, IkSettings, efforts, follow, frames, peaks, task
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.clearance import min_clearance, tool_of
from kendama_cli.robot_model.placement.motion_check import limit_ratios
from kendama_cli.robot_model.placement.placement import joint_trajectory
from kendama_cli.schema.arrays import Array
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

GAME = kendama_game()
POINT_CUP = dataclasses.replace(GAME.cup, radius_m=1e-6, depth_m=1e-6, wall_m=1e-7)
"""The chain takes what the tip holds for a point mass at the tie point."""
WEIGHTS = (0.7, 2.0, 0.3, 1.0, 0.05, 0.02, 0.1)


@pytest.fixture(scope="module")
def arm() -> RobotModel:
    return RobotModel(dataclasses.replace(bench_arm(), redundancy_weights=WEIGHTS), POINT_CUP, GAME.gravity_m_s2)


def test_places_and_jacobian_are_those_of_dart(arm: RobotModel) -> None:
    chain = compiled_chain(arm)
    tool = tool_of(arm, chain, GAME)
    root, rng = heading_turn(arm.settings.base_heading_rad), np.random.default_rng(1)
    rotations, shifts, jacobian = np.empty((8, 3, 3)), np.empty((8, 3)), np.empty((5, 7))
    for _ in range(20):
        angles = rng.uniform(-1.5, 1.5, 7)
        frames(chain, angles, rotations, shifts)
        value = task(chain, tool, rotations, shifts, jacobian)
        theirs, their_jacobian = arm.cup_task(angles)
        assert root @ value[:3] + arm.settings.base_position_m == pytest.approx(theirs[:3], abs=1e-12)
        assert root[:2, :2] @ value[3:] == pytest.approx(theirs[3:], abs=1e-12)
        assert root @ jacobian[:3] == pytest.approx(their_jacobian[:3], abs=1e-12)
        assert root[:2, :2] @ jacobian[3:] == pytest.approx(their_jacobian[3:], abs=1e-12)


def test_torques_are_those_of_dart_and_the_known_friction(arm: RobotModel) -> None:
    chain = compiled_chain(arm)
    tool = tool_of(arm, chain, GAME)._replace(mass_kg=POINT_CUP.mass_kg)
    rng = np.random.default_rng(2)
    for _ in range(20):
        angles, speeds, changes = (
            rng.uniform(-1.5, 1.5, 7),
            rng.normal(scale=rng.choice([0.05, 1.0]), size=7),
            5 * rng.normal(size=7),
        )
        theirs = arm.rigid_effort_nm(angles, speeds, changes) + arm.friction.torque_nm(speeds, np.sign(speeds))
        assert efforts(chain, tool, angles, speeds, changes) == pytest.approx(theirs, abs=1e-4)


def _swing(t_s: Array) -> Array:
    return np.column_stack([0.25 * np.sin(3 * t_s) ** 2, 0 * t_s, 0.2 * np.sin(2 * t_s) ** 2])


def test_the_way_along_a_path_and_its_peaks_are_those_of_the_arm(arm: RobotModel) -> None:
    t_s = np.linspace(0.0, 2.0, 401)
    joints = joint_trajectory(arm, t_s, _swing(t_s))
    chain = compiled_chain(arm)
    tool = tool_of(arm, chain, GAME)._replace(mass_kg=POINT_CUP.mass_kg)
    path = _swing(t_s) @ heading_turn(arm.settings.base_heading_rad)
    angles, missed = follow(chain, tool, IkSettings(arm.home_rad, arm.redundancy_weights), path, False)
    assert missed.max() < 1e-7
    assert angles == pytest.approx(joints.position_rad, abs=1e-6)
    ours = peaks(chain, tool, Curve(angles, 0.005, np.ones(401), 0.0))
    theirs = limit_ratios(arm, joints)
    limits = (arm.limits.velocity_rad_s, arm.limits.acceleration_rad_s2, arm.limits.effort_nm)
    for found, limit, fraction in zip(ours, limits, (theirs.velocity, theirs.acceleration, theirs.effort), strict=True):
        # differences of 5 ms, and torques looked at every 15 ms
        assert found / limit == pytest.approx(fraction, rel=0.02, abs=0.01)


def test_beyond_reach_the_path_ends_unless_the_whole_is_wanted(arm: RobotModel) -> None:
    chain = compiled_chain(arm)
    tool, ik = tool_of(arm, chain, GAME), IkSettings(arm.home_rad, arm.redundancy_weights)
    path = np.linspace(0.0, 3.0, 31)[:, None] * [1.0, 0.0, 0.0]
    _, missed = follow(chain, tool, ik, path, False)
    _, whole = follow(chain, tool, ik, path, True)
    first = int(np.argmax(missed > 1e-6))
    assert 0 < first < 30
    assert np.isinf(missed[first + 1 :]).all()
    assert np.isfinite(whole).all()
    assert whole[-1] > 1.0


def test_an_arm_folded_onto_itself_overlaps_and_the_parts_are_named(arm: RobotModel) -> None:
    t_s = np.array([0.0, 1.0])
    still = np.zeros((2, 7))
    folded = still + np.array([0.0, 0.0, 0.0, 2.9, 0.0, 0.0, 0.0])
    joints = joint_trajectory(arm, np.linspace(0, 1, 5), np.zeros((5, 3)))
    one = dataclasses.replace(joints, t_s=t_s, position_rad=folded, velocity_rad_s=still, acceleration_rad_s2=still)
    clear = min_clearance(arm, GAME, one)
    assert clear.gap_m < 0
    assert "'" in clear.parts or "swing" in clear.parts
    assert min_clearance(arm, GAME, joints).gap_m > 0.0
