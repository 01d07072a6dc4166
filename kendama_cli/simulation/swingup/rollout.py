"""What goes into a rollout of the swing-up and what comes out of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.state import SwingState

Numbers = Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True)
class RolloutNoise:
    """All that is random in one rollout, drawn beforehand: what is learned meanwhile does not change it."""

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


@dataclass(frozen=True)
class SimulatedRollout:
    """How a rollout went; ``final`` is the true state at its end, ``tension_n`` the rope's pull in its last step.

    ``half_swings`` is what count_half_swings gives for the ball's true rates.
    """

    outcome: Outcome
    duration_s: float
    peak_displacement_m: float
    half_swings: int
    final: SwingState
    tension_n: float


@dataclass(frozen=True)
class Catch:
    """How the free flight after the goal went, without contact: distance of ball and cup at the rim plane."""

    miss_m: float
    duration_s: float
