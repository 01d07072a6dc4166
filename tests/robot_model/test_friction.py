"""The friction's formulas joint by joint in plain Python, and what an identified one adds to a robot's own."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.artifacts.friction_model import FrictionModel, NetworkFriction, ParametricFriction
from kendama_cli.robot_model.friction import direction, friction_torque, with_identified
from tests.simulation.dart.bench_robot import bench_arm

RNG = np.random.default_rng(1)
NETWORK = NetworkFriction(RNG.normal(size=(7, 3, 3)), RNG.normal(size=(7, 4)))
FOUND = ParametricFriction(*RNG.normal(0.0, 1.0, (2, 7)), RNG.uniform(0.1, 0.3, 7), *RNG.normal(0.0, 1.0, (2, 7)))
TOP = RNG.uniform(0.5, 2.0, 7)


def _model(chosen: str) -> FrictionModel:
    return FrictionModel(tuple(f"j{k}" for k in range(7)), chosen, FOUND, NETWORK, TOP, np.ones(7), np.ones(7))


def test_the_network_reads_logarithms_of_speeds_and_their_smooth_signs_and_stays_beyond_the_highest() -> None:
    for speeds in RNG.choice([0.002, 0.1, 1.0, 5.0], (20, 7)) * RNG.normal(size=(20, 7)):
        found = friction_torque(_model("network"), speeds)
        for k, v in enumerate(speeds.tolist()):
            u = math.asinh(v / 0.05) / math.asinh(TOP[k] / 0.05)
            u, sign, torque = max(-1.0, min(1.0, u)), math.tanh(v / 0.005), NETWORK.output[k, 3]
            for unit, weights in enumerate(NETWORK.hidden[k].tolist()):
                torque += NETWORK.output[k, unit] * math.tanh(weights[0] * u + weights[1] * sign + weights[2])
            assert found[k] == pytest.approx(torque, abs=1e-12)
        dry = FOUND.coulomb_nm + FOUND.stribeck_nm * np.exp(-((speeds / FOUND.stribeck_rad_s) ** 2))
        law = dry * np.tanh(speeds / 0.005) + FOUND.viscous_nm_s * speeds + FOUND.offset_nm
        assert friction_torque(_model("parametric"), speeds) == pytest.approx(law, abs=1e-12)
        assert direction(speeds) == pytest.approx(np.tanh(speeds / 0.005))


@pytest.mark.parametrize("known", [True, False])
def test_identified_friction_adds_to_the_robot_s_own_never_below_zero_with_the_stronger_stribeck_speed(
    known: bool,
) -> None:
    names = ("coulomb_nm", "viscous_nm_s", "stribeck_nm")
    own = {name: tuple(RNG.uniform(0, 1, 7).tolist()) if known else None for name in names}
    robot = dataclasses.replace(bench_arm(), **own, stribeck_rad_s=(0.07,) * 7 if known else None)
    worn = with_identified(robot, _model("network"))
    for name in names:
        total = np.maximum(np.array(own[name] or (0.0,) * 7) + getattr(FOUND, name), 0.0)
        assert getattr(worn, name) == pytest.approx(total)
    stronger = np.abs(FOUND.stribeck_nm) > (np.array(own["stribeck_nm"]) if known else -1.0)
    assert worn.stribeck_rad_s == pytest.approx(np.where(stronger, FOUND.stribeck_rad_s, 0.07))
    assert with_identified(robot, None) is robot
