"""The impedance law: what the arm's tool then does, on arms made up at random."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.motion.rotation import exp_of
from kendama_cli.plugins.interact.conformance import bench_state, resting_at
from kendama_cli.plugins.interact.impedance_law import Impedance, modal_damping, pose_error, task_inertia

RNG = np.random.default_rng(2)
STIFFNESS = np.array([500.0, 900.0, 200.0, 30.0, 30.0, 30.0])
LAW = Impedance(STIFFNESS, damping_ratio=1.0, posture_1_s2=25.0, reach_m=0.02, spin_free=False)
SPINNING = dataclasses.replace(LAW, spin_free=True)
NONE = np.zeros(3)


def _moving():
    state = bench_state()
    n = len(state.position_rad)
    state = dataclasses.replace(state, velocity_rad_s=RNG.normal(size=n))
    reference = dataclasses.replace(
        resting_at(state),
        position_m=state.tool_m + RNG.normal(0, 0.05, 3),
        rotation=exp_of(RNG.normal(0, 0.3, 3)) @ state.tool_rotation,
        velocity=RNG.normal(size=6),
        acceleration=RNG.normal(size=6),
    )
    return state, reference


@pytest.mark.parametrize("ratio", [0.3, 0.7, 1.0, 1.5])
def test_every_mode_of_the_tool_has_the_damping_ratio_that_was_asked_for(ratio):
    for _ in range(10):
        root = RNG.normal(size=(6, 6))
        inertia = root @ root.T + 0.1 * np.eye(6)
        root = RNG.normal(size=(6, 6))
        stiffness = root @ root.T * 100 + np.eye(6)
        damping = modal_damping(inertia, stiffness, ratio)
        assert damping == pytest.approx(damping.T, abs=1e-8 * np.abs(damping).max())
        # the eigenvalues of a mode are -w (ratio +- sqrt(ratio^2 - 1)): their product is w^2, their sum -2 ratio w
        system = np.block([[np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(inertia, np.hstack([stiffness, damping]))]])
        eigenvalues = np.linalg.eigvals(system)
        speeds = np.sqrt(np.linalg.eigvals(np.linalg.solve(inertia, stiffness)).real)
        wanted = np.concatenate([-w * (ratio + np.array([1, -1]) * np.sqrt(complex(ratio**2 - 1))) for w in speeds])
        for value in wanted:  # a double root is only as exact as the root of the rounding
            assert np.abs(eigenvalues - value).min() < 1e-5 * np.abs(eigenvalues).max()


def test_the_tool_moves_as_a_mass_on_springs_and_dampers_pushed_by_what_it_touches():
    """Lambda (x'' - xd'' - J' (q' - qr')) + D (x' - xd') = K e + f_wanted + f, whatever the posture does.

    Here the arm has no Coriolis forces: tests/simulation/dart/test_task_world.py has them.
    """
    for _ in range(20):
        state, reference = _moving()
        push, touch = RNG.normal(0, 5, 3), RNG.normal(0, 5, 6)
        command = LAW.command(state, reference, RNG.normal(size=7), push)
        joints = np.linalg.solve(state.inertia, command.torque_nm + state.jacobian.T @ touch)
        inertia, _ = task_inertia(state.jacobian, state.inertia)
        damping = modal_damping(inertia, np.diag(STIFFNESS), 1.0)
        drift = state.jacobian_rate @ command.velocity_rad_s
        left = inertia @ (state.jacobian @ joints + drift - reference.acceleration)
        left += damping @ (state.jacobian @ state.velocity_rad_s - reference.velocity)
        right = STIFFNESS * pose_error(reference, state, spin_free=False) + touch
        right[:3] += push
        assert left == pytest.approx(right, abs=1e-9 * np.abs(right).max())


def test_the_posture_moves_the_joints_but_not_the_tool():
    state, reference = _moving()
    torques = [LAW.command(state, reference, posture, NONE).torque_nm for posture in RNG.normal(0, 2, (2, 7))]
    joints = np.linalg.solve(state.inertia, torques[1] - torques[0])
    assert np.abs(joints).max() > 1.0
    assert np.abs(state.jacobian @ joints).max() < 1e-9 * np.abs(joints).max()


def test_the_wanted_joint_speeds_give_the_wanted_tool_speed():
    state, reference = _moving()
    speeds = LAW.command(state, reference, state.position_rad, NONE).velocity_rad_s
    assert state.jacobian @ speeds == pytest.approx(reference.velocity, abs=1e-9)


def test_along_a_wanted_force_no_spring_acts_within_reach_and_only_the_rest_beyond_it():
    state = bench_state()
    axis = np.array([0.6, 0.0, -0.8])
    stiffness = float(axis**2 @ STIFFNESS[:3])
    for distance, wanted in ((0.015, 0.0), (-0.02, 0.0), (0.05, 0.03 * stiffness), (-0.05, -0.03 * stiffness)):
        here = resting_at(state)
        away = dataclasses.replace(here, position_m=here.position_m + distance * axis, force_axis=axis, force_share=1.0)
        torque = LAW.command(state, away, state.position_rad, NONE).torque_nm
        force = np.linalg.lstsq(state.jacobian.T, torque, rcond=None)[0]
        assert force == pytest.approx([*(wanted * axis), 0, 0, 0], abs=1e-6)


def test_the_springs_stay_a_potential_while_they_give_way_to_a_force():
    """A symmetric stiffness that is nowhere negative stores energy and gives back no more: it is passive."""
    state = bench_state()
    for share in (0.0, 0.4, 1.0):
        axis = RNG.normal(size=3)
        axis /= np.linalg.norm(axis)
        columns = []
        for direction in 0.001 * np.eye(3):
            here = resting_at(state)
            away = dataclasses.replace(here, position_m=here.position_m + direction, force_axis=axis, force_share=share)
            torque = LAW.command(state, away, state.position_rad, NONE).torque_nm
            columns.append(np.linalg.lstsq(state.jacobian.T, torque, rcond=None)[0][:3] / 0.001)
        stiffness = np.array(columns)
        assert stiffness == pytest.approx(stiffness.T, abs=1e-6)
        eigenvalues = np.linalg.eigvalsh(stiffness)
        assert eigenvalues.min() > -1e-6
        if share == 0.0:
            assert stiffness == pytest.approx(np.diag(STIFFNESS[:3]), abs=1e-6)
        if share == 1.0:
            assert axis @ stiffness @ axis == pytest.approx(0.0, abs=1e-6)


def test_a_tool_free_to_spin_is_moved_as_before_but_not_turned_about_its_own_axis():
    state, reference = _moving()
    axis = state.tool_rotation[:, 2]
    torque = SPINNING.command(state, resting_at(state), state.position_rad, NONE).torque_nm
    spun = dataclasses.replace(resting_at(state), rotation=exp_of(0.7 * axis) @ state.tool_rotation)
    assert SPINNING.command(state, spun, state.position_rad, NONE).torque_nm == pytest.approx(torque, abs=1e-9)
    speeds = SPINNING.command(state, reference, state.position_rad, NONE).velocity_rad_s
    missing = state.jacobian @ speeds - reference.velocity
    assert missing[:3] == pytest.approx(NONE, abs=1e-9)
    assert np.cross(missing[3:], axis) == pytest.approx(NONE, abs=1e-9)
    assert abs(missing[3:] @ axis) > 0.1


def test_the_turn_to_an_axis_is_the_least_that_brings_it_there():
    state = bench_state()
    for angle in (0.0, 1e-12, 1e-4, 0.5, 3.0):
        axis = np.cross(state.tool_rotation[:, 2], RNG.normal(size=3))
        turn = angle * axis / np.linalg.norm(axis)
        wanted = exp_of(turn) @ state.tool_rotation @ exp_of([0.0, 0.0, 1.3])
        reference = dataclasses.replace(resting_at(state), rotation=wanted)
        assert pose_error(reference, state, spin_free=True)[3:] == pytest.approx(turn, abs=1e-9)


def test_where_the_arm_is_stretched_out_speeds_and_torques_stay_bounded():
    state, reference = _moving()
    u, s, vt = np.linalg.svd(state.jacobian, full_matrices=False)
    for least in (1e-3, 1e-6, 0.0):
        stretched = dataclasses.replace(state, jacobian=u @ np.diag([*s[:5], least]) @ vt)
        command = LAW.command(stretched, reference, state.position_rad, NONE)
        assert np.abs(command.velocity_rad_s).max() < 100
        assert np.isfinite(command.torque_nm).all()
        assert np.abs(command.torque_nm).max() < 1e5
