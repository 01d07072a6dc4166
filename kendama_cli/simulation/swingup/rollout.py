"""Input and result of a rollout of the swing-up."""

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
