"""Perturbed simulations of a search: sampled from the declared uncertainty, with the results of all motions in them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from kendama_cli.adaptation.settings import UncertaintySettings
from kendama_cli.adaptation.trial import MotionVariation, Repeat, Trial
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.arm_errors import ArmErrors
from kendama_cli.simulation.dart.world_errors import NO_ERRORS, WorldErrors

BLOCK = 4
"""Simulations that evaluate come in Latin hypercubes of this size: one in each quarter of every factor's range."""

MAX_BLOCKS = 3
"""Blocks in which the best candidates are evaluated."""

FACTORS = 9


@dataclass(frozen=True)
class Perturbation:
    """Errors of one simulation and of the arm in it, and the noise of what is measured there.

    ``joint_noise_rad`` is the standard deviation of the angles read, drawn from ``rng``; ``sensor_seed`` is the seed of
    the sensor model.
    """

    world: WorldErrors
    arm: ArmErrors | None
    sensor_seed: int
    joint_noise_rad: float = 0.0
    rng: np.random.Generator | None = None


@dataclass(frozen=True)
class PerturbedSimulations:
    """Perturbed simulations of one search, by their seeds, and the repeats that were run in them.

    Attributes: ``uncertainty``, to sample from; ``rope_m``, the rope's length; ``seeds``, first that of all samples of
    the search, then one for each evaluation and one for each repeat that confirms, so that their number changes nothing
    before them; ``evaluated``, the repeats of each candidate in order; ``confirmed``, those of the chosen motion.
    """

    uncertainty: UncertaintySettings
    rope_m: float
    seeds: tuple[int, ...]
    evaluated: tuple[tuple[MotionVariation, tuple[Repeat, ...]], ...] = ()
    confirmed: tuple[Repeat, ...] = ()

    @staticmethod
    def seeded(
        uncertainty: UncertaintySettings, rope_m: float, repeats: int, rng: np.random.Generator
    ) -> PerturbedSimulations:
        """Return the simulations of a new search that ends with ``repeats``, their seeds drawn from ``rng``."""
        seeds = rng.integers(2**62, size=1 + BLOCK * MAX_BLOCKS + repeats)
        return PerturbedSimulations(uncertainty, rope_m, tuple(seeds.tolist()))

    def perturbation(self, trial: Trial) -> Perturbation:
        """Return the perturbation in which ``trial`` is run."""
        if trial.kind in {"explore", "validate"}:
            stream = (0, trial.group) if trial.kind == "explore" else (1, trial.group, trial.index)
            rng = np.random.default_rng([self.seeds[0], *stream])
            factors = rng.random(FACTORS)
            return self._sampled(factors, int(rng.integers(2**62)), rng)
        confirms = trial.kind == "confirm"
        seed = self.seeds[1 + trial.index + BLOCK * MAX_BLOCKS * confirms]
        rng = np.random.default_rng(seed)
        return self._sampled(rng.random(FACTORS) if confirms else self._in_block(trial.index), seed, rng)

    def undisturbed(self) -> Perturbation:
        """Return the simulation as modelled, in which the sensor model alone is noisy."""
        return Perturbation(NO_ERRORS, None, self.seeds[1])

    def repeats(self, variation: MotionVariation) -> tuple[Repeat, ...]:
        """Return the repeats that evaluated ``variation`` until now."""
        return dict(self.evaluated).get(variation, ())

    def with_repeat(self, trial: Trial, repeat: Repeat) -> PerturbedSimulations:
        """Return these simulations with the ``repeat`` that ``trial`` asked for."""
        if trial.kind == "confirm":
            return replace(self, confirmed=(*self.confirmed, repeat))
        evaluated = {**dict(self.evaluated), trial.variation: (*self.repeats(trial.variation), repeat)}
        return replace(self, evaluated=tuple(evaluated.items()))

    def _in_block(self, index: int) -> Array:
        """Return the factors (FACTORS,) in [0, 1) of the evaluation ``index``."""
        block, inside = divmod(index, BLOCK)
        rng = np.random.default_rng([self.seeds[0], block])
        quarter = rng.permuted(np.tile(np.arange(BLOCK), (FACTORS, 1)), axis=1)[:, inside]
        return np.asarray((quarter + rng.random((BLOCK, FACTORS))[inside]) / BLOCK)

    def _sampled(self, factors: Array, sensor_seed: int, rng: np.random.Generator) -> Perturbation:
        """Return the perturbation with every quantity at its fraction ``factors`` (FACTORS,) of the declared range."""
        uncertainty = self.uncertainty
        rope, ball, mass = 2 * factors[:3] - 1
        drag, friction, restitution, lag, frequency, phase = factors[3:]
        world = WorldErrors(
            rope_scale=float(1 + rope * uncertainty.rope_m / self.rope_m),
            ball_start_m=float(ball * uncertainty.ball_start_m),
            joint_friction_nm=float(friction * uncertainty.joint_friction_nm),
            joint_friction_fraction=uncertainty.joint_friction_fraction,
            restitution=_between(uncertainty.restitution, restitution),
            mass_scale=float(1 + mass * uncertainty.mass_fraction),
            drag_scale=_log_between(uncertainty.drag_scale, drag),
        )
        arm = ArmErrors(
            lag_s=_between(uncertainty.lag_s, lag),
            cup_error_m=uncertainty.cup_error_m,
            cup_error_hz=_log_between(uncertainty.cup_error_hz, frequency),
            cup_error_phase_rad=float(2 * math.pi * phase),
        )
        return Perturbation(world, arm, sensor_seed, uncertainty.joint_noise_rad, rng)


def _between(limits: tuple[float, float], fraction: float) -> float:
    return float(limits[0] + fraction * (limits[1] - limits[0]))


def _log_between(limits: tuple[float, float], fraction: float) -> float:
    return float(limits[0] * (limits[1] / limits[0]) ** fraction)
