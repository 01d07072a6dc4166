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
    values = plain("adapt/uncertainty", name) | ({"restitution": [0.2, 0.2]} if name == "none" else {})
    return build(UncertaintySettings, values, "uncertainty")


def _drawn(preset: str, count: int, *, held: bool = False) -> list[Perturbation]:
    simulations = PerturbedSimulations.seeded(_preset(preset), 0.4, count, np.random.default_rng(10000), held=held)
    return [simulations.perturbation(Trial("confirm", MotionVariation(1.0), index)) for index in range(count)]


def _arm(perturbation: Perturbation) -> ArmErrors:
    assert perturbation.arm is not None
    return perturbation.arm


def test_a_laboratorys_quantities_have_the_declared_distributions() -> None:
    """Kolmogorov and Smirnov's test against scipy's own distributions of the figures in lab.yaml."""
    draws = _drawn("lab", DRAWS)
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
    ):
        assert stats.kstest(values, expected.cdf).pvalue > 1e-3
    factors = np.array(
        [[one.world.ball_start_y_m, one.world.gravity_tilt_y_rad, one.sensor.latency_s] for one in draws]
    )
    assert np.abs(np.corrcoef(factors.T) - np.eye(3)).max() < 4 / np.sqrt(DRAWS)


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
