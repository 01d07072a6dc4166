"""Perturbation of one simulation: errors of kendama, arm, sensor and network, sampled from a declared uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.adaptation.image_errors import EXACT, SensorErrors
from kendama_cli.adaptation.settings import UncertaintySettings
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.arm_errors import ArmErrors, WorldErrors

FACTORS, BALL_START = 9, 1
"""Number of the factors that are sampled, and which of them is new in each rollout of one arm and kendama."""
LABORATORY, LABORATORY_FACTORS = 2, 9
"""Random stream of the factors that a laboratory adds, and their number."""


@dataclass(frozen=True)
class Perturbation:
    """Errors of one simulation and of the arm in it, and the noise of what is measured there.

    ``joint_noise_rad`` is the standard deviation of the angles read, sampled from ``rng``; ``sensor_seed`` is the
    seed of the sensor model.
    """

    world: WorldErrors
    arm: ArmErrors | None
    sensor_seed: int
    joint_noise_rad: float = 0.0
    rng: np.random.Generator | None = None
    sensor: SensorErrors = EXACT


@dataclass(frozen=True)
class LaboratoryFactors:
    """Factors in [0, 1) of what a laboratory adds; the first three and the phases' changes are new in each rollout."""

    ball_start_y: float
    phase_change: float
    phase_change_y: float
    gravity_tilt: float
    frequency_y: float
    phase_y: float
    rotors: float
    resonance: float
    latency: float

    @staticmethod
    def of(held: Array, fresh: Array) -> LaboratoryFactors:
        """Return the factors of a rollout, ``fresh`` (9,), in a simulation whose own are ``held`` (9,)."""
        return LaboratoryFactors(*fresh[:3].tolist(), *held[3:].tolist())


def sampled(
    uncertainty: UncertaintySettings,
    rope_m: float,
    factors: Array,
    laboratory: LaboratoryFactors,
    *,
    sensor_seed: int,
    rng: np.random.Generator,
) -> Perturbation:
    """Return the perturbation with every quantity at its fraction ``factors`` (FACTORS,) of the declared range."""
    rope, ball, mass = 2 * factors[:3] - 1
    drag, friction, restitution, lag, frequency, phase = factors[3:]
    change = uncertainty.cup_error_phase_change
    world = WorldErrors(
        rope_scale=float(1 + rope * uncertainty.rope_m / rope_m),
        ball_start_m=float(ball * uncertainty.ball_start_m),
        ball_start_y_m=(2 * laboratory.ball_start_y - 1) * uncertainty.ball_start_y_m,
        gravity_tilt_y_rad=(2 * laboratory.gravity_tilt - 1) * uncertainty.gravity_tilt_rad,
        joint_friction_nm=float(friction * uncertainty.joint_friction_nm),
        joint_friction_fraction=uncertainty.joint_friction_fraction,
        restitution=_between(uncertainty.restitution, restitution),
        mass_scale=float(1 + mass * uncertainty.mass_fraction),
        drag_scale=_log_between(uncertainty.drag_scale, drag),
        wrist_rotor_scale=_log_between(uncertainty.rotor_scale, laboratory.rotors),
    )
    arm = ArmErrors(
        lag_s=_between(uncertainty.lag_s, lag),
        cup_error_m=uncertainty.cup_error_m,
        cup_error_hz=_log_between(uncertainty.cup_error_hz, frequency),
        cup_error_phase_rad=float(2 * math.pi * (phase + change * laboratory.phase_change)),
        cup_error_y_m=uncertainty.cup_error_y_m,
        cup_error_y_hz=_log_between(uncertainty.cup_error_hz, laboratory.frequency_y),
        cup_error_y_phase_rad=2 * math.pi * (laboratory.phase_y + change * laboratory.phase_change_y),
        resonance_hz=_between(uncertainty.resonance_hz, laboratory.resonance),
        resonance_damping=uncertainty.resonance_damping,
        lost_commands=uncertainty.lost_commands,
        lost_burst=uncertainty.lost_burst,
    )
    sensor = SensorErrors(
        latency_s=_between(uncertainty.image_latency_s, laboratory.latency),
        repeated=uncertainty.repeated_images,
        repeated_stamp_s=uncertainty.repeated_stamp_s,
        wrong=uncertainty.wrong_detections,
        wrong_m=uncertainty.wrong_detection_m,
        seed=sensor_seed,
    )
    return Perturbation(world, arm, sensor_seed, uncertainty.joint_noise_rad, rng, sensor)


def _between(limits: tuple[float, float], fraction: float) -> float:
    return float(limits[0] + fraction * (limits[1] - limits[0]))


def _log_between(limits: tuple[float, float], fraction: float) -> float:
    return float(limits[0] * (limits[1] / limits[0]) ** fraction)
