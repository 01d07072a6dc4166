"""The interface of an engine of the swing's dynamics (``learn.engine``), and the limiters of its cup."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import LimitedWorkspace
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.physics.taut_rope import Ball, rope_angle, rope_rate
from kendama_cli.settings.game import GameSettings


def limiter(settings: LearnSettings) -> BrakingLimiter:
    """Keep position and velocity within ``learn.workspace``; if leaving ends the rollout, the velocity alone."""
    workspace = settings.workspace
    maximum = max(settings.max_action_m_s2, settings.goal.catch_acceleration_m_s2)
    limited = isinstance(workspace, LimitedWorkspace)
    return BrakingLimiter(
        half_width_m=workspace.half_width_m if limited else math.inf,
        max_speed_m_s=workspace.max_speed_m_s,
        braking_m_s2=workspace.braking_m_s2 if isinstance(workspace, LimitedWorkspace) else maximum,
        max_m_s2=maximum,
        period_s=settings.step_s,
    )


def catch_limiter(settings: LearnSettings) -> BrakingLimiter:
    """Keep position and velocity within ``learn.workspace`` after the release, whatever leaving it means before."""
    workspace = settings.workspace
    limited = limiter(settings)
    weaker = min(settings.max_action_m_s2, settings.goal.catch_acceleration_m_s2)
    return BrakingLimiter(
        half_width_m=workspace.half_width_m,
        max_speed_m_s=workspace.max_speed_m_s,
        braking_m_s2=limited.braking_m_s2 if isinstance(workspace, LimitedWorkspace) else BRAKING_SHARE * weaker,
        max_m_s2=limited.max_m_s2,
        period_s=settings.step_s,
    )


def mouth_m(game: GameSettings) -> float:
    """Return the maximum distance from the cup's axis at which the ball's centre may come down [m]."""
    return game.cup.radius_m - game.ball.radius_m


class SwingEngine(Protocol):
    """A cup that moves along x and a ball on a rope tied to it, in the plane of the swing.

    After ``start`` and every ``step`` the attributes hold the present state. The ball's position and velocity are
    relative to the tie point: ``across_m`` along x, ``above_m`` along z, the tie point's own velocity taken off.
    """

    x_m: float
    """The cup's position along x, 0 in the centre of the workspace."""
    velocity_m_s: float
    """The cup's velocity along x."""
    across_m: float
    above_m: float
    across_m_s: float
    above_m_s: float

    @property
    def reference(self) -> tuple[float, float]:
        """Return the cup's commanded position and velocity, x [m] and v [m/s], which a limiter keeps inside."""

    @property
    def tension_n(self) -> float:
        """The rope's tension in the step that led here [N]; 0 where it is slack."""

    @property
    def in_cup(self) -> bool | None:
        """True if the ball lies in the cup; None in an engine in which they do not touch."""

    def take_on(self, rope_scale: float, drag_scale: float) -> None:
        """Take on a rope so many times as long and an air drag so many times as large, from the next ``start`` on."""

    def start(self, state: SwingState) -> None:
        """Begin at ``state`` with the rope stretched as by the hanging ball."""

    def step(self, acceleration_m_s2: float) -> None:
        """Advance by one time step, the cup commanded to accelerate so along x."""

    def check_finite(self, t_s: float) -> None:
        """Raise SimulationError if the numbers have left their domain by ``t_s``."""


def rate(swing: SwingEngine) -> float:
    """Return the ball's angular velocity about the tie point [rad/s]."""
    return rope_rate(Ball(swing.across_m, swing.above_m, swing.across_m_s, swing.above_m_s))


def state_of(swing: SwingEngine) -> SwingState:
    """Return the true plain state now."""
    angle = rope_angle(swing.across_m, swing.above_m)
    return SwingState(swing.x_m, swing.velocity_m_s, angle, rate(swing))


StepCallback = Callable[[float, SwingEngine, float], None]
"""Called with the time, the engine and the cup's acceleration after every time step."""
