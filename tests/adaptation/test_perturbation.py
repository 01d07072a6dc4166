"""Errors that a laboratory adds to the perturbed simulations; the other presets add none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy import stats

from kendama_cli.adaptation.image_errors import SensorErrors
from kendama_cli.adaptation.perturbation import Perturbation
from kendama_cli.adaptation.search_record import MotionVariation, PerturbedSimulations, Trial
from kendama_cli.adaptation.settings import UncertaintySettings
from kendama_cli.schema.settings import build
from kendama_cli.simulation.dart.arm_errors import ArmErrors
from tests.shipped_conf import plain

DRAWS = 500


def _preset(name: str) -> UncertaintySettings:
    changes = {"none": {"restitution": [0.2, 0.2]}, "lab": {"joint_friction_nm": 2.0}}
    values = plain("adapt/uncertainty", name) | changes.get(name, {})
    return build(UncertaintySettings, values, "uncertainty")


def _drawn(preset: str, count: int, *, held: bool = False) -> list[Perturbation]:
    simulations = PerturbedSimulations.seeded(_preset(preset), 0.4, count, np.random.default_rng(10000), held=held)
    return [simulations.perturbation(Trial("confirm", MotionVariation(1.0), index)) for index in range(count)]


def _arm(perturbation: Perturbation) -> ArmErrors:
    assert perturbation.arm is not None
    return perturbation.arm


def test_a_laboratorys_quantities_have_the_declared_distributions() -> None:
    """Kolmogorov and Smirnov's test against scipy's own distributions of the figures in lab.yaml."""
    draws, lab = _drawn("lab", DRAWS), _preset("lab")
    arms, turn = [_arm(one) for one in draws], 2 * np.pi
    uniform, logarithmic = stats.uniform, stats.loguniform
    for values, expected in (
        ([one.world.ball_start_y_m for one in draws], uniform(-0.005, 0.01)),
        ([one.world.gravity_tilt_y_rad for one in draws], uniform(-0.01745, 0.0349)),
        ([one.world.wrist_rotor_scale for one in draws], logarithmic(0.2, 2.0)),
        ([one.world.restitution for one in draws], uniform(0.1, 0.5)),
        ([one.sensor.latency_s for one in draws], uniform(0.0, 0.02)),
        ([one.resonance_hz for one in arms], uniform(6.0, 6.0)),
        ([one.cup_error_y_hz for one in arms], logarithmic(0.2, 6.0)),
        ([one.cup_error_phase_rad % turn for one in arms], uniform(0.0, turn)),
        ([one.cup_error_y_phase_rad % turn for one in arms], uniform(0.0, turn)),
        ([one.world.rope_scale for one in draws], uniform(1 - lab.rope_m / 0.4, 2 * lab.rope_m / 0.4)),
        ([one.world.ball_start_m for one in draws], uniform(-lab.ball_start_m, 2 * lab.ball_start_m)),
        ([one.world.mass_scale for one in draws], uniform(1 - lab.mass_fraction, 2 * lab.mass_fraction)),
        ([one.world.joint_friction_nm for one in draws], uniform(0.0, lab.joint_friction_nm)),
        ([one.world.drag_scale for one in draws], logarithmic(0.5, 2.0)),
        ([one.lag_s for one in arms], uniform(0.0, 0.03)),
        ([one.cup_error_hz for one in arms], logarithmic(*lab.cup_error_hz)),
    ):
        assert stats.kstest(values, expected.cdf).pvalue > 1e-3
    names = ("ball_start_y_m", "gravity_tilt_y_rad", "rope_scale", "ball_start_m", "mass_scale", "joint_friction_nm")
    factors = np.array([[one.sensor.latency_s, *(getattr(one.world, name) for name in names)] for one in draws])
    assert np.abs(np.corrcoef(factors.T) - np.eye(7)).max() < 4 / np.sqrt(DRAWS)
    for fixed in ("cup_error_m", "cup_error_y_m", "resonance_damping", "lost_commands", "lost_burst"):
        assert {getattr(one, fixed) for one in arms} == {getattr(lab, fixed)}
    assert {one.world.joint_friction_fraction for one in draws} == {lab.joint_friction_fraction}


@pytest.mark.parametrize("preset", ["hard", "identified", "none"])
def test_the_other_presets_have_none_of_a_laboratorys_errors(preset: str) -> None:
    for one in _drawn(preset, 20):
        world, arm = one.world, _arm(one)
        assert (world.ball_start_y_m, world.gravity_tilt_y_rad, world.wrist_rotor_scale) == (0.0, 0.0, 1.0)
        assert (arm.cup_error_y_m, arm.resonance_hz, arm.lost_commands) == (0.0, 0.0, 0.0)
        assert one.sensor == SensorErrors(seed=one.sensor_seed)


def _differing(draws: Sequence[Perturbation]) -> set[str]:
    """The quantities that differ from rollout to rollout."""
    named = [vars(one.world) | vars(_arm(one)) | {"latency_s": one.sensor.latency_s} for one in draws]
    return {name for name in named[0] if len({one[name] for one in named}) > 1}


def test_in_one_laboratory_starts_and_phases_alone_are_new_in_each_rollout() -> None:
    starts = {"ball_start_m", "ball_start_y_m"}
    assert _differing(_drawn("lab", 5, held=True)) == starts | {"cup_error_phase_rad", "cup_error_y_phase_rad"}
    assert _differing(_drawn("hard", 5, held=True)) == {"ball_start_m"}
