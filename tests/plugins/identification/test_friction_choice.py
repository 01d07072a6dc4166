"""Friction: each law is found again, and the better model is the one that is kept."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.artifacts.friction_model import FrictionModel, NetworkFriction, ParametricFriction
from kendama_cli.plugins.identification.friction_choice import FrictionSamples, choose_friction, fit_parametric
from kendama_cli.robot_model.friction import friction_torque, network_torque, parametric_torque, with_identified
from kendama_cli.schema.arrays import Array
from tests.simulation.dart.bench_robot import bench_arm

LAW = ParametricFriction(
    coulomb_nm=np.array([0.5, 2.0, 0.0]),
    stribeck_nm=np.array([0.3, 0.0, 0.0]),
    stribeck_rad_s=np.array([0.08, 1.0, 1.0]),
    viscous_nm_s=np.array([0.2, 0.0, 1.5]),
    offset_nm=np.array([0.0, 0.1, -0.2]),
)
NOISE_NM = 0.02


def samples(torque: Array, velocity: Array) -> FrictionSamples:
    return FrictionSamples(velocity, torque, np.abs(velocity) > 0.01)


def velocities(rng: np.random.Generator, count: int = 3000) -> Array:
    """Speeds from 0.01 to 2 rad/s in both directions, as many slow as fast ones."""
    return np.asarray(np.exp(rng.uniform(np.log(0.011), np.log(2.0), (count, 3))) * rng.choice([-1.0, 1.0], (count, 3)))


def of_law(seed: int) -> FrictionSamples:
    rng = np.random.default_rng(seed)
    velocity = velocities(rng)
    return samples(parametric_torque(LAW, velocity) + rng.normal(0.0, NOISE_NM, velocity.shape), velocity)


def test_coulomb_stribeck_viscous_friction_and_offset_are_found_again() -> None:
    one = of_law(1)
    found = fit_parametric(one.velocity_rad_s, one.torque_nm, one.kept)
    # 3000 samples with noise 0.02 leave 0.02 / sqrt(3000) = 0.4 mNm; the terms share it unevenly, up to tenfold
    assert found.coulomb_nm == pytest.approx(LAW.coulomb_nm, abs=0.005)
    assert found.viscous_nm_s == pytest.approx(LAW.viscous_nm_s, abs=0.005)
    assert found.offset_nm == pytest.approx(LAW.offset_nm, abs=0.003)
    assert found.stribeck_nm[0] == pytest.approx(0.3, abs=0.01)
    assert found.stribeck_rad_s[0] == pytest.approx(0.08, rel=0.1)  # the grid's spacing
    assert (found.stribeck_nm[1:] == 0.0).all()


def test_the_fitted_law_is_odd_but_for_its_offset() -> None:
    speed = np.linspace(0.0, 3.0, 40)[:, None] * np.ones(3)
    both = parametric_torque(LAW, speed) + parametric_torque(LAW, -speed)
    assert both == pytest.approx(2 * np.tile(LAW.offset_nm, (40, 1)))


def test_where_the_law_is_parametric_the_parametric_model_is_kept() -> None:
    model = choose_friction("abc", of_law(1), of_law(2), hidden=8, rng=np.random.default_rng(0))
    assert model.chosen == "parametric"
    assert model.parametric_rms_nm == pytest.approx(np.full(3, NOISE_NM), rel=0.1)
    assert (model.network_rms_nm < 2 * NOISE_NM).all()  # and the network has learned it as well


def test_where_the_law_is_of_another_kind_the_network_is_kept() -> None:
    def other(velocity: Array) -> Array:
        """Friction with a dip at middling speeds, and more of it in one direction than in the other."""
        dip = 0.5 * np.exp(-2 * np.log(np.abs(velocity) / 0.3) ** 2)
        return np.asarray(np.where(velocity > 0, 1.0 - dip, -0.7 + 0.5 * dip))

    rng = np.random.default_rng(3)
    one, two = velocities(rng), velocities(rng)
    model = choose_friction("abc", samples(other(one), one), samples(other(two), two), hidden=8, rng=rng)
    assert model.chosen == "network"
    assert (model.network_rms_nm < 0.3 * model.parametric_rms_nm).all()
    assert np.array_equal(friction_torque(model, two), network_torque(model.network, two, model.max_speed_rad_s))


def test_a_few_blows_of_the_ball_change_nothing_to_speak_of() -> None:
    clean = of_law(1)
    hit = clean.torque_nm.copy()
    hit[::100] += 5.0
    held_out = of_law(2)
    plain, struck = (
        choose_friction("abc", one, held_out, hidden=4, rng=np.random.default_rng(0)).parametric
        for one in (clean, dataclasses.replace(clean, torque_nm=hit))
    )
    assert struck.coulomb_nm == pytest.approx(plain.coulomb_nm, abs=0.01)


def test_the_same_seed_gives_the_same_model() -> None:
    one, other, third = (
        choose_friction("abc", of_law(1), of_law(2), hidden=4, rng=np.random.default_rng(seed)) for seed in (0, 0, 1)
    )
    assert np.array_equal(one.network.hidden, other.network.hidden)
    assert not np.array_equal(one.network.hidden, third.network.hidden)


def test_beyond_the_speeds_it_has_seen_the_network_stays_as_it_is_there() -> None:
    model = choose_friction("abc", of_law(1), of_law(2), hidden=4, rng=np.random.default_rng(0))
    edge, beyond = (network_torque(model.network, k * model.max_speed_rad_s, model.max_speed_rad_s) for k in (1.0, 5.0))
    assert beyond == pytest.approx(edge, abs=1e-9)


def network(joints: int) -> NetworkFriction:
    return NetworkFriction(np.zeros((joints, 2, 3)), np.zeros((joints, 3)))


def test_a_model_whose_parts_are_for_different_joints_is_refused() -> None:
    three = np.ones(3)
    with pytest.raises(ValueError, match="network is for 2 joints, not 3"):
        FrictionModel(("a", "b", "c"), "network", LAW, network(2), three, three, three)
    with pytest.raises(ValueError, match="chosen must be 'parametric' or 'network', not 'best'"):
        FrictionModel(("a", "b", "c"), "best", LAW, network(3), three, three, three)
    with pytest.raises(ValueError, match="stribeck_rad_s must be positive"):
        dataclasses.replace(LAW, stribeck_rad_s=np.zeros(3))


def test_a_simulated_arm_gets_the_identified_friction_on_top_of_its_own() -> None:
    robot, seven = bench_arm(), np.ones(7)
    found = ParametricFriction(0.5 * seven, 0.4 * seven, 0.1 * seven, -100.0 * seven, 0.3 * seven)
    model = FrictionModel(tuple("abcdefg"), "parametric", found, network(7), seven, seven, seven)
    worn = with_identified(robot, model)
    assert robot.coulomb_nm is not None
    assert worn.coulomb_nm == pytest.approx(np.array(robot.coulomb_nm) + 0.5)
    assert worn.viscous_nm_s == (0.0,) * 7  # no motor drives itself
    assert worn.stribeck_rad_s is not None
    assert worn.stribeck_rad_s[2:] == pytest.approx(np.full(5, 0.1))
    assert worn.stribeck_rad_s[:2] == pytest.approx(np.array(robot.stribeck_rad_s)[:2])  # the known one is stronger
    assert with_identified(robot, None) is robot
