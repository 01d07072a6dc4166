"""What may differ from what was assumed, and how much of it a motion stands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from kendama_cli.adaptation.settings import UncertaintySettings
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.arm_errors import ArmErrors
from kendama_cli.simulation.dart.world_errors import WorldErrors

BLOCK = 4
"""Judging draws come in blocks of so many, each a Latin hypercube: one draw in each quarter of every factor's range."""

FACTORS = 9

MOUTH_SHARE = 0.85
"""A ball whose centre comes down within this share of the cup's radius stays inside.

Measured over four windows of two swings with restitutions of 0.1 to 0.4: the outermost that always stayed were at 0.6
to 1.1 of the radius, farther on the side toward which the ball drifts.
"""

LEAST_SPREAD_M = 0.002
"""Joint noise alone scatters the miss by this much or more."""


@dataclass(frozen=True)
class Repeat:
    """One perturbed rollout; ``miss_m`` is None where the ball never came down through the rim's plane.

    ``steered_m`` is how far a seen catch had moved the cup beside its plan then, ``swing_slack_s`` for how long the
    rope hung slack before.
    """

    caught: bool
    miss_m: float | None
    steered_m: float = 0.0
    swing_slack_s: float = 0.0


@dataclass(frozen=True)
class Draw:
    """One world of those that may be, and the arm in it."""

    world: WorldErrors
    arm: ArmErrors


def drawn_errors(uncertainty: UncertaintySettings, rope_m: float, rng: np.random.Generator) -> Draw:
    """One of those that may be."""
    return _errors_at(uncertainty, rope_m, rng.random(FACTORS))


def judging_errors(uncertainty: UncertaintySettings, rope_m: float, index: int, seed: int) -> Draw:
    """The world number ``index`` in which candidates are judged: the same for every candidate of a search."""
    block, inside = divmod(index, BLOCK)
    rng = np.random.default_rng([seed, block])
    quarter = rng.permuted(np.tile(np.arange(BLOCK), (FACTORS, 1)), axis=1)[:, inside]
    return _errors_at(uncertainty, rope_m, (quarter + rng.random((BLOCK, FACTORS))[inside]) / BLOCK)


def _errors_at(uncertainty: UncertaintySettings, rope_m: float, share: Array) -> Draw:
    """The world at ``share`` (FACTORS,) of the way from the least to the largest of everything that may differ."""
    rope, ball, mass = 2 * share[:3] - 1
    drag, friction, restitution, lag, frequency, phase = share[3:]
    return Draw(
        WorldErrors(
            rope_scale=float(1 + rope * uncertainty.rope_m / rope_m),
            ball_start_m=float(ball * uncertainty.ball_start_m),
            joint_friction_nm=float(friction * uncertainty.joint_friction_nm),
            joint_friction_fraction=uncertainty.joint_friction_fraction,
            restitution=_between(uncertainty.restitution, restitution),
            mass_scale=float(1 + mass * uncertainty.mass_fraction),
            drag_scale=_log_between(uncertainty.drag_scale, drag),
        ),
        ArmErrors(
            lag_s=_between(uncertainty.lag_s, lag),
            cup_error_m=uncertainty.cup_error_m,
            cup_error_hz=_log_between(uncertainty.cup_error_hz, frequency),
            cup_error_phase_rad=float(2 * math.pi * phase),
        ),
    )


def _between(ends: tuple[float, float], share: float) -> float:
    return float(ends[0] + share * (ends[1] - ends[0]))


def _log_between(ends: tuple[float, float], share: float) -> float:
    return float(ends[0] * (ends[1] / ends[0]) ** share)


def expected_success(judged: Sequence[Repeat], mouth_m: float) -> float:
    """The share of all worlds that would be caught, by the misses in those that were ``judged``.

        p = mean_i P(|m_i + h e| < mouth_m),   e standard normal,   h = 1.06 s n^(-1/5)

    with s the smaller of the misses' standard deviation and their interquartile range over 1.34 (B. W. Silverman,
    Density Estimation, 1986, eq. 3.31), at least LEAST_SPREAD_M. A world whose ball never came down, or was lost
    although it came down within ``mouth_m``, counts as lost.
    """
    misses = np.array([one.miss_m for one in judged if one.miss_m is not None and _came_of_its_miss(one, mouth_m)])
    if len(misses) == 0:
        return 0.0
    quarter, three = np.quantile(misses, [0.25, 0.75])
    spread = min(float(np.std(misses, ddof=1)), float(three - quarter) / 1.34) if len(misses) > 1 else 0.0
    width = max(1.06 * spread * len(misses) ** -0.2, LEAST_SPREAD_M)
    caught = ndtr((mouth_m - misses) / width) - ndtr((-mouth_m - misses) / width)
    return float(caught.sum()) / len(judged)


def needed_m(judged: Sequence[Repeat]) -> float:
    """How far the balls came down from where the cup was planned to be, on average; 1 m where one never did."""
    return sum(1.0 if one.miss_m is None else abs(one.miss_m) + one.steered_m for one in judged) / len(judged)


def _came_of_its_miss(one: Repeat, mouth_m: float) -> bool:
    return one.caught or abs(one.miss_m or 0.0) >= mouth_m
