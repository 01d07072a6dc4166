"""The arm's dynamics beside MuJoCo's on the same description."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.robot_model.model import RobotModel
from tests.benchmarks.arm import mujoco_model
from tests.robot_model.inertia import inertia_of
from tests.robot_model.test_model import ready
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

mujoco = pytest.importorskip("mujoco", reason="mujoco (the extra 'benchmarks') is not installed")


@pytest.mark.parametrize("name", ["pa10", "iiwa"])
def test_inertia_and_bias_agree_with_mujoco(name: str) -> None:
    """H and C q' + g of equations.md eq. 2 for the bare links; MuJoCo drops the frames' masses of 1e-6 kg."""
    game = kendama_game()
    settings = bench_arm() if name == "pa10" else ready(name)
    arm = RobotModel(dataclasses.replace(settings, rotor_inertia_kg_m2=None), game.cup, game.gravity_m_s2)
    model = mujoco_model(arm, game)
    data = mujoco.MjData(model)
    n, rng = len(arm.joint_names), np.random.default_rng(3)
    for _ in range(10):
        position = rng.uniform(np.maximum(arm.limits.lower_rad, -3.0), np.minimum(arm.limits.upper_rad, 3.0))
        speed = rng.normal(0.0, 1.0, n)
        data.qpos[:n], data.qvel[:n] = position, speed
        data.qpos[n:] = [50.0, 0.0, 0.0]  # out of the way
        mujoco.mj_forward(model, data)
        inertia = inertia_of(arm, position)
        bias = arm.rigid_effort_nm(position, speed, np.zeros(n))
        for axis in range(n):
            unit, column = np.zeros(model.nv), np.zeros(model.nv)
            unit[axis] = 1.0
            mujoco.mj_mulM(model, data, column, unit)
            assert column[:n] == pytest.approx(inertia[axis], abs=1e-4)
        assert data.qfrc_bias[:n] == pytest.approx(bias, abs=1e-3)
