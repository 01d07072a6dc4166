"""From demonstrations to one movement primitive: encode each, average the parameters, measure what was lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.motion.basis import centers_equal_in_time, widths_by_spacing
from kendama_cli.motion.dmp import play
from kendama_cli.motion.regression import least_squares_on_position, locally_weighted, ridge_on_force
from kendama_cli.motion.resampling import Swing, swing
from kendama_cli.settings.encode import EncodeSettings

COORDINATES = ("x", "y", "z")


@dataclass(frozen=True)
class Deviation:
    """Distances between a primitive's motion and samples [m]: ``rms_m``, ``max_m``, ``final_m`` at the last sample."""

    rms_m: float
    max_m: float
    final_m: float
    samples: int


def prepare(demonstration: Demonstration, settings: EncodeSettings) -> Swing:
    """The demonstration as the regression reads it; raises ValueError, naming it, where it cannot be encoded."""
    try:
        return swing(
            demonstration.t_s,
            demonstration.position_m,
            smoothing_s=settings.smoothing_s,
            rest_speed_m_s=settings.rest_speed_m_s,
            rest_share=settings.rest_share,
            margin_s=settings.margin_s if settings.trim == "rest" else None,
        )
    except ValueError as error:
        raise ValueError(f"demonstration '{demonstration.name}': {error}") from None


def encode_swing(prepared: Swing, settings: EncodeSettings) -> MotionPlan:
    """The primitive of one swing; its duration, goal and weights are the paper's 22 parameters per coordinate."""
    centers = centers_equal_in_time(settings.functions, settings.phase_decay)
    widths = widths_by_spacing(centers, settings.width)
    return MotionPlan(
        coordinates=COORDINATES,
        duration_s=prepared.duration_s,
        tau_scale=1.0,
        stiffness=settings.stiffness,
        phase_decay=settings.phase_decay,
        start_m=np.zeros(len(COORDINATES)),
        start_velocity_m_s=prepared.start_rate / prepared.duration_s,
        goal_m=prepared.goal_m,
        weights=_weights(prepared, centers, widths, settings),
        centers=centers,
        widths=widths,
    )


def average(plans: Sequence[MotionPlan]) -> MotionPlan:
    """The primitive whose goal, duration, weights and start rate are the means over ``plans`` of one basis.

    The start velocity is averaged per motion (dy/ds = velocity x duration), as the weights are: so the average
    primitive's path is the average of the paths at equal shares of their durations.
    """
    first = plans[0]
    duration = float(np.mean([plan.duration_s for plan in plans]))
    rate = np.mean([plan.start_velocity_m_s * plan.duration_s for plan in plans], axis=0)
    return MotionPlan(
        coordinates=first.coordinates,
        duration_s=duration,
        tau_scale=1.0,
        stiffness=first.stiffness,
        phase_decay=first.phase_decay,
        start_m=np.mean([plan.start_m for plan in plans], axis=0),
        start_velocity_m_s=rate / duration,
        goal_m=np.mean([plan.goal_m for plan in plans], axis=0),
        weights=np.mean([plan.weights for plan in plans], axis=0),
        centers=first.centers,
        widths=first.widths,
    )


def encode_demonstrations(demonstrations: Sequence[Demonstration], settings: EncodeSettings) -> MotionPlan:
    """The average primitive of all ``demonstrations``, each taken relative to its own start and duration.

    Raises ValueError where a demonstration does not move or is too short.
    """
    return average([encode_swing(prepare(demonstration, settings), settings) for demonstration in demonstrations])


def deviation(plan: MotionPlan, prepared: Swing) -> Deviation:
    """How far ``plan``, played at the swing's own duration, is from its samples."""
    t_s = prepared.share * plan.duration_s * plan.tau_scale
    distance = np.linalg.norm(play(plan, t_s).position_m - prepared.position_m, axis=1)
    return Deviation(
        rms_m=float(np.sqrt(np.mean(distance**2))),
        max_m=float(distance.max()),
        final_m=float(distance[-1]),
        samples=len(distance),
    )


def _weights(prepared: Swing, centers: Array, widths: Array, settings: EncodeSettings) -> Array:
    stiffness, decay = settings.stiffness, settings.phase_decay
    if settings.regression == "lwr":
        return locally_weighted(prepared, centers, widths, stiffness=stiffness, decay=decay, passes=settings.passes)
    fit = ridge_on_force if settings.regression == "ridge" else least_squares_on_position
    return fit(prepared, centers, widths, stiffness=stiffness, decay=decay, penalty=settings.ridge)
