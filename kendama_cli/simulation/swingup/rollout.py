"""Input of a rollout of the swing-up, sampled beforehand, and its result."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import RandomisationSettings

Numbers = Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True)
class RolloutNoise:
    """All that is random in one rollout, sampled beforehand: what is learned meanwhile does not change it."""

    start_angle_rad: float
    start_position_m: float
    angle_rad: Numbers
    """Error of the angle's reading in each step."""
    rate_rad_s: Numbers
    """Error of the rate's reading in each step."""
    gain: Numbers
    """Factor on the acceleration of each action."""
    workspace_scale: float = 1.0
    """Factor on the size of the workspace, see LearnSettings.with_workspace_scale."""
    rope_scale: float = 1.0
    """Factor on the rope's length."""
    drag_scale: float = 1.0
    """Factor on the air's drag."""
    delay_steps: int = 0
    """Time steps after which an action takes effect."""


@dataclass(frozen=True)
class Catch:
    """The flight after the swing-up: where the ball came down beside the cup's axis, and whether into the cup."""

    miss_m: float
    duration_s: float
    caught: bool


@dataclass(frozen=True)
class SimulatedRollout:
    """Result of a rollout; ``final`` is the true state at the end of the swing-up, which took ``duration_s``.

    ``half_swings`` is what count_half_swings gives for the ball's true rates. ``catch`` is the flight that followed,
    None where the ball was not released (or the goal not reached).
    """

    outcome: Outcome
    duration_s: float
    peak_displacement_m: float
    half_swings: int
    final: SwingState
    catch: Catch | None = None

    @property
    def success(self) -> bool:
        """Return True if the rollout did the task."""
        return self.outcome == "goal"

    @property
    def caught(self) -> bool:
        """Return True if the ball came down into the cup."""
        return self.catch is not None and self.catch.caught


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
