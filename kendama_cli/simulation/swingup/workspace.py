"""The limiters that ``learn.workspace`` asks for, in the simulation: its cup obeys at once."""

from __future__ import annotations

import math

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.task_settings import LimitedWorkspace
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.settings.game import GameSettings


def limiter(settings: LearnSettings) -> BrakingLimiter:
    """Keep position and velocity within ``learn.workspace``; if leaving ends the rollout, the velocity alone."""
    workspace = settings.workspace
    maximum = max(settings.largest_action_m_s2, settings.goal.catch_acceleration_m_s2)
    limited = isinstance(workspace, LimitedWorkspace)
    return BrakingLimiter(
        half_width_m=workspace.half_width_m if limited else math.inf,
        max_speed_m_s=workspace.max_speed_m_s,
        braking_m_s2=workspace.braking_m_s2 if isinstance(workspace, LimitedWorkspace) else maximum,
        largest_m_s2=maximum,
        period_s=settings.step_s,
    )


def catch_limiter(settings: LearnSettings) -> BrakingLimiter:
    """Keep position and velocity within ``learn.workspace`` after the release, whatever leaving it means before."""
    workspace = settings.workspace
    limited = limiter(settings)
    weaker = min(settings.largest_action_m_s2, settings.goal.catch_acceleration_m_s2)
    return BrakingLimiter(
        half_width_m=workspace.half_width_m,
        max_speed_m_s=workspace.max_speed_m_s,
        braking_m_s2=limited.braking_m_s2 if isinstance(workspace, LimitedWorkspace) else BRAKING_SHARE * weaker,
        largest_m_s2=limited.largest_m_s2,
        period_s=settings.step_s,
    )


def mouth_m(game: GameSettings) -> float:
    """Return the maximum distance from the cup's axis at which the ball's centre may come down [m]."""
    return game.cup.radius_m - game.ball.radius_m
