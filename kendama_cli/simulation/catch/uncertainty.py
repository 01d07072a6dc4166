"""What may differ from what was assumed, and how much of it a motion stands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from kendama_cli.simulation.catch.settings import UncertaintySettings
from kendama_cli.simulation.dart.arm_errors import ArmErrors
from kendama_cli.simulation.dart.world_errors import WorldErrors

CORNERS = ((1, 1), (-1, -1), (1, -1), (-1, 1))
"""Signs of the rope's error and the ball's offset: a full factorial design of two factors at their extremes."""

MOUTH_SHARE = 0.85
"""A ball whose centre comes down within this share of the cup's radius stays inside.

Measured over four windows of two swings with restitutions of 0.1 to 0.4: the outermost that always stayed were at 0.6
to 1.1 of the radius, farther on the side toward which the ball drifts.
"""

LEAST_SPREAD_M = 0.002
"""Joint noise alone scatters the miss by this much or more."""


@dataclass(frozen=True)
class Repeat:
    """One perturbed rollout; ``miss_m`` is None where the ball never came down through the rim's plane."""

    caught: bool
    miss_m: float | None


@dataclass(frozen=True)
class Draw:
    """One world of those that may be, and the arm in it."""

    world: WorldErrors
    arm: ArmErrors


def drawn_errors(uncertainty: UncertaintySettings, rope_m: float, rng: np.random.Generator) -> Draw:
    """One of those that may be."""
    rope, ball, mass, drag = rng.uniform(-1, 1, 4)
    friction, restitution, lag, frequency, phase = rng.uniform(0, 1, 5)
    return Draw(
        WorldErrors(
            rope_scale=1 + rope * uncertainty.rope_m / rope_m,
            ball_start_m=ball * uncertainty.ball_start_m,
            joint_friction_nm=friction * uncertainty.joint_friction_nm,
            joint_friction_share=uncertainty.joint_friction_share,
            restitution=_between(uncertainty.restitution, restitution),
            mass_scale=1 + mass * uncertainty.mass_share,
            drag_scale=_log_between(uncertainty.drag_scale, 0.5 * (1 + drag)),
        ),
        ArmErrors(
            lag_s=_between(uncertainty.lag_s, lag),
            cup_error_m=uncertainty.cup_error_m,
            cup_error_hz=_log_between(uncertainty.cup_error_hz, frequency),
            cup_error_phase_rad=2 * math.pi * phase,
        ),
    )


def corner_errors(uncertainty: UncertaintySettings, rope_m: float, index: int) -> Draw:
    """The extreme world number ``index`` of CORNERS; every restitution, drag and lag meets every sign of either error.

    The cup's error is at the middle of its frequencies, and turns a quarter from one corner to the next.
    """
    rope, ball = CORNERS[index]
    return Draw(
        WorldErrors(
            rope_scale=1 + rope * uncertainty.rope_m / rope_m,
            ball_start_m=ball * uncertainty.ball_start_m,
            joint_friction_nm=uncertainty.joint_friction_nm,
            joint_friction_share=uncertainty.joint_friction_share,
            restitution=uncertainty.restitution[index // 2],
            mass_scale=1 + rope * ball * uncertainty.mass_share,
            drag_scale=uncertainty.drag_scale[index // 2],
        ),
        ArmErrors(
            lag_s=uncertainty.lag_s[index % 2],
            cup_error_m=uncertainty.cup_error_m,
            cup_error_hz=_log_between(uncertainty.cup_error_hz, 0.5),
            cup_error_phase_rad=0.5 * math.pi * index,
        ),
    )


def _between(ends: tuple[float, float], share: float) -> float:
    return ends[0] + share * (ends[1] - ends[0])


def _log_between(ends: tuple[float, float], share: float) -> float:
    return float(ends[0] * (ends[1] / ends[0]) ** share)


def predicted_success(nominal_m: float, corners: Sequence[Repeat], mouth_m: float) -> float:
    """The share of all worlds between the ``corners`` that would be caught, by a bilinear model of the miss.

        m(u, v) = m0 + a u + b v + c u v + s e;   u, v uniform in [-1, 1], e standard normal

    m0, a, b, c are those of the four corners; s is how far m0 is from the nominal miss, or LEAST_SPREAD_M. A world is
    caught where |m| < ``mouth_m``. Corners that were lost although their ball came down within it count against all.
    """
    misses = [corner.miss_m for corner in corners]
    if any(miss is None for miss in misses):
        return 0.5 * sum(corner.caught for corner in corners) / len(corners)
    signs = np.array(CORNERS, dtype=np.float64)
    design = np.column_stack([np.ones(4), signs, signs[:, 0] * signs[:, 1]])
    m0, a, b, c = design.T @ np.array(misses, dtype=np.float64) / 4
    spread = max(abs(m0 - nominal_m), LEAST_SPREAD_M)
    u, v = np.meshgrid(*[(np.arange(40) + 0.5) / 20 - 1] * 2)
    m = m0 + a * u + b * v + c * u * v
    share = float(np.mean(ndtr((mouth_m - m) / spread) - ndtr((-mouth_m - m) / spread)))
    lost = sum(not corner.caught and abs(corner.miss_m or 0.0) < mouth_m for corner in corners)
    return share * (1 - lost / len(corners))
