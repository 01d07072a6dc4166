"""A primitive made larger or smaller."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan


def scaled_plan(plan: MotionPlan, amplitude: float, tau_scale: float) -> MotionPlan:
    """The primitive with its motion about the start made ``amplitude`` times as large, played at ``tau_scale``.

    The equations are linear in place, goal, weights and end velocities together, so the whole path scales.
    """
    return dataclasses.replace(
        plan,
        tau_scale=tau_scale,
        start_velocity_m_s=plan.start_velocity_m_s * amplitude,
        goal_m=plan.start_m + amplitude * (plan.goal_m - plan.start_m),
        goal_velocity_m_s=plan.goal_velocity_m_s * amplitude,
        weights=plan.weights * amplitude,
        variation=np.hstack((plan.variation[:, :1], plan.variation[:, 1:] * amplitude)),
    )
