"""Noise that differs from rollout to rollout, sampled beforehand."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.task_settings import RandomisationSettings
from kendama_cli.simulation.swingup.rollout import RolloutNoise

FURTHEST_ERROR = 3.0
"""Errors of the acceleration are cut at this many standard deviations: no actuator's error is unbounded."""


def draw_noise(settings: LearnSettings, bodies: RandomisationSettings, rng: np.random.Generator) -> RolloutNoise:
    """Sample one rollout's noise at the levels of ``learn.noise``, on one of the ``bodies``."""
    levels, n = settings.noise, max(1, round(settings.rollout_s / settings.step_s))
    start = rng.standard_normal(2).tolist()
    readings = rng.standard_normal((2, n))
    errors = rng.standard_normal(n).clip(-FURTHEST_ERROR, FURTHEST_ERROR)
    strength, offset, longer, narrower, later = rng.uniform((-1.0, -1.0, -1.0, 0.0, 0.0), 1.0).tolist()
    noise, drag = rng.uniform((bodies.noise[0], bodies.drag[0]), (bodies.noise[1], bodies.drag[1])).tolist()
    return RolloutNoise(
        start_angle_rad=noise * math.radians(levels.start_angle_deg) * start[0],
        start_position_m=noise * levels.start_position_m * start[1],
        angle_rad=noise * math.radians(levels.angle_reading_deg) * readings[0]
        + math.radians(bodies.angle_deg) * offset,
        rate_rad_s=noise * levels.rate_reading_rad_s * readings[1],
        gain=(1.0 + noise * levels.acceleration * errors) * (1.0 + bodies.acceleration * strength),
        workspace_scale=1.0 - bodies.workspace_shrink * narrower,
        rope_scale=1.0 + bodies.rope * longer,
        drag_scale=drag,
        delay_steps=round(bodies.delay_s * later / settings.step_s),
    )


def no_noise(settings: LearnSettings) -> RolloutNoise:
    """Return the noise of the nominal rollout: none."""
    n = max(1, round(settings.rollout_s / settings.step_s))
    none = (0.0,) * n
    return RolloutNoise(0.0, 0.0, none, none, (1.0,) * n)
