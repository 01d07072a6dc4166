"""An arm's motion for a primitive: its path by the arm's own forward kinematics, its rates by differences."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.robot_model.arm_motion import SAMPLE_S, ArmMotion
from tests.robot_model.placement.test_placement_search import PLAN
from tests.simulation.dart.bench_robot import bench_arm, modelled

LEAD_IN = 5.0


@pytest.mark.parametrize("tau", [1.0, 1.7])
def test_the_cup_runs_the_path_upright_and_rates_are_those_of_the_angles(tau: float) -> None:
    arm = modelled(bench_arm())
    start = dataclasses.replace(PLAN, start_velocity_m_s=np.array([0.3, 0.1]))
    motion = ArmMotion(arm, start, LEAD_IN)
    joints = motion.joints(tau, 4.0)
    assert joints.t_s == pytest.approx(SAMPLE_S * np.arange(len(joints.t_s)))
    moving_s = (motion.lead_in_s + start.duration_s) * tau
    assert joints.t_s[-1] == pytest.approx(moving_s + 4.0, abs=SAMPLE_S)
    reference = motion.cup_reference_m(tau, joints.t_s)
    for k in range(0, len(joints.t_s), 97):
        value, _ = arm.cup_task(joints.position_rad[k])
        assert value == pytest.approx([*reference[k], 0.0, 0.0], abs=1e-6)
    assert motion.cup_reference_m(tau, np.array([0.0, 1e3])) == pytest.approx(reference[[0, -1]], abs=1e-6)
    h, q = SAMPLE_S, joints.position_rad
    inside = joints.t_s[1:-1] < motion._t_s[-1] * tau - 2 * h
    slope, bend = (q[2:] - q[:-2]) / (2 * h), np.diff(q, 2, axis=0) / h**2
    assert joints.velocity_rad_s[1:-1][inside] == pytest.approx(slope[inside], abs=2e-3)
    assert joints.acceleration_rad_s2[1:-1][inside] == pytest.approx(bend[inside], abs=0.2)
    assert motion.lead_in_s > 0.02
    after = joints.t_s > motion._t_s[-1] * tau  # it has settled
    assert moving_s < motion._t_s[-1] * tau < moving_s + 3.9
    assert (joints.position_rad[after] == joints.position_rad[-1]).all()
    assert joints.velocity_rad_s[~after].any(axis=1)[1:].all()
    assert not joints.velocity_rad_s[after].any()
    assert not joints.acceleration_rad_s2[after].any()
    ratios = np.abs(joints.velocity_rad_s).max(axis=0) / arm.limits.velocity_rad_s
    assert ratios * tau == pytest.approx(motion.velocity_ratios, rel=0.01)
    ratios = np.abs(joints.acceleration_rad_s2).max(axis=0) / arm.limits.acceleration_rad_s2
    assert ratios * tau**2 == pytest.approx(motion.acceleration_ratios, rel=0.03)
    at_it = motion.joints(motion.min_tau_scale(), 0.0)
    used = [
        np.abs(at_it.velocity_rad_s).max(axis=0) / arm.limits.velocity_rad_s,
        np.abs(at_it.acceleration_rad_s2).max(axis=0) / arm.limits.acceleration_rad_s2,
    ]
    assert np.max(used) == pytest.approx(1.0, rel=0.03)
    kind, joint = np.unravel_index(int(np.argmax(used)), (2, 7))
    unit = (("speed", arm.limits.velocity_rad_s, "rad/s"), ("acceleration", arm.limits.acceleration_rad_s2, "rad/s^2"))
    assert f"'{arm.joint_names[joint]}' with its {unit[kind][0]} limit" in motion.limiting_joint()
    assert f"{unit[kind][1][joint]:.1f}"[:3] in motion.limiting_joint()
