"""The arm's dynamics beside MuJoCo's on the same description."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.simulation.dart.arm import Arm
from tests.benchmarks.arm import mujoco_model
from tests.simulation.dart.bench_robot import kendama_game, pa10
from tests.simulation.dart.test_arm import ready

mujoco = pytest.importorskip("mujoco", reason="mujoco (the extra 'benchmarks') is not installed")


@pytest.mark.parametrize("name", ["pa10", "iiwa"])
def test_inertia_and_bias_agree_with_mujoco(name: str) -> None:
    """H and C q' + g of PAPER.md eq. 2 for the bare links; MuJoCo drops the frames' masses of 1e-6 kg."""
    game = kendama_game()
    settings = pa10() if name == "pa10" else ready(name)
    arm = Arm(dataclasses.replace(settings, rotor_inertia_kg_m2=None), game.cup)
    model = mujoco_model(arm, game)
    data = mujoco.MjData(model)
    n, rng = len(arm.joint_names), np.random.default_rng(3)
    for _ in range(10):
        place = rng.uniform(np.maximum(arm.lower_rad, -3.0), np.minimum(arm.upper_rad, 3.0))
        speed = rng.normal(0.0, 1.0, n)
        data.qpos[:n], data.qvel[:n] = place, speed
        data.qpos[n:] = [50.0, 0.0, 0.0]  # out of the way
        mujoco.mj_forward(model, data)
        arm.skeleton.setPositions(place)
        arm.skeleton.setVelocities(speed)
        inertia = np.array(arm.skeleton.getMassMatrix())
        bias = np.array(arm.skeleton.getCoriolisAndGravityForces())
        for axis in range(n):
            unit, column = np.zeros(model.nv), np.zeros(model.nv)
            unit[axis] = 1.0
            mujoco.mj_mulM(model, data, column, unit)
            assert column[:n] == pytest.approx(inertia[axis], abs=1e-4)
        assert data.qfrc_bias[:n] == pytest.approx(bias, abs=1e-3)
