"""The hand-written pump: its law, and that it brings the energy of a ball to what is asked for."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.energy_pumping import EnergyPumpingLearner, EnergyPumpingPolicy
from kendama_cli.learning.settings import EnergyPumpingSettings, LearnSettings
from kendama_cli.learning.state import SwingState
from tests.learning.settings_files import learn_settings

LAW = EnergyPumpingSettings("energy_pumping", 0.8, 3.0, 0.3, 0.4, 6.0, 1.5)


def acting(law: EnergyPumpingSettings) -> tuple[EnergyPumpingPolicy, LearnSettings]:
    settings = dataclasses.replace(learn_settings("easy", "learn/learner=energy_pumping"), learner=law)
    return EnergyPumpingPolicy(EnergyPumpingLearner(settings).policy, settings), settings


def test_it_accelerates_by_the_missing_energy_against_the_swing_and_springs_to_the_centre() -> None:
    policy, settings = acting(LAW)
    clipped, rng, most = 0, np.random.default_rng(10023), settings.actions_m_s2[-1]
    for _ in range(300):
        x, v, angle, rate = rng.normal(0.0, [0.1, 0.3, 1.2, 5.0]).tolist()
        height_m, speed_m_s = 0.4 - 0.4 * math.cos(angle), 0.4 * rate
        missing = 9.81 * (0.4 + 0.8 * 0.4) - (9.81 * height_m + 0.5 * speed_m_s**2)
        gain, way = (3.0 if missing > 0 else 3.0 * 0.4), 1.0 if rate > 0 else -1.0
        wanted = -gain * missing * math.cos(angle - 0.3 * way) * way - 6.0 * x - 1.5 * v
        clipped += abs(wanted) > most
        policy.begin_rollout()
        assert policy.act(SwingState(x, v, angle, rate), 0.0) == pytest.approx(np.clip(wanted, -most, most))
    assert 30 < clipped < 270


def test_it_brings_a_ball_to_the_energy_that_is_asked_for() -> None:
    """Pendulum on a cup that accelerates so, phi'' = -(g sin phi + a cos phi) / l, without a spring; as far as
    its acceleration is held.
    """
    policy, _ = acting(EnergyPumpingSettings("energy_pumping", -0.2, 3.0, 0.0, 1.0, 0.0, 0.0))
    policy.begin_rollout()
    angle, rate, h = 0.2, 0.0, 1e-3
    for k in range(20_000):
        a = policy.act(SwingState(0.0, 0.0, math.remainder(angle, 2 * math.pi), rate), k * h)
        rate -= h * (9.81 * math.sin(angle) + a * math.cos(angle)) / 0.4
        angle += h * rate
    energy = 9.81 * 0.4 * (1 - math.cos(angle)) + 0.5 * (0.4 * rate) ** 2
    assert energy == pytest.approx(9.81 * 0.4 * 0.8, rel=0.05)


def test_constants_of_another_shape_are_refused() -> None:
    _, settings = acting(LAW)
    artifact = PolicyArtifact.seal("energy_pumping", {}, {"constants": np.zeros(5)})
    with pytest.raises(ValueError, match=r"constants of shape \(5,\); allowed: \(6,\)"):
        EnergyPumpingPolicy(artifact, settings)
