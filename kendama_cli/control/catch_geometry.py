"""Geometry of a catch: the cup's line, the heights at which it meets the ball, and what keeps it inside."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from kendama_cli.control.settings import CatchSettings
from kendama_cli.learning.reward import Flight
from kendama_cli.learning.task_settings import GoalSettings
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings


@dataclass(frozen=True)
class CatchGeometry:
    """Centre and direction of the line (3,) in the world, heights, and the limiter that keeps the cup on the line.

    The cup is aimed at the ball's centre at ``catch_height_m``; ``rim_height_m`` is where the ball begins to touch.
    """

    middle_m: Array
    direction: Array
    catch_height_m: float
    rim_height_m: float
    flight: Flight
    limiter: BrakingLimiter

    @property
    def below_rim_lever_m(self) -> float:
        """Height of the ball's aim over the tie point."""
        return self.catch_height_m - float(self.middle_m[2])

    def along(self, vector: Array) -> float:
        """Return the part of ``vector`` along the line."""
        return float(self.direction @ vector)


def make_catch_geometry(
    middle_m: Array, direction: Array, game: GameSettings, catch: CatchSettings, *, rope_scale: float, period_s: float
) -> CatchGeometry:
    """Return the geometry about ``middle_m`` (3,), the tie point at x = 0, along the unit vector ``direction``.

    ``rope_scale`` is the real rope's length over the model's.
    """
    rim_m = float(middle_m[2]) + game.cup.rim_m
    return CatchGeometry(
        middle_m=np.asarray(middle_m),
        direction=np.asarray(direction),
        catch_height_m=rim_m - catch.below_rim_m,
        rim_height_m=rim_m + game.ball.radius_m,
        flight=Flight.of(game, rope_scale),
        limiter=BrakingLimiter(
            half_width_m=catch.half_width_m,
            max_speed_m_s=catch.max_speed_m_s,
            braking_m_s2=BRAKING_SHARE * catch.acceleration_m_s2,
            max_m_s2=catch.acceleration_m_s2,
            period_s=period_s,
        ),
    )


def goal_here(goal: GoalSettings, catch: CatchSettings) -> GoalSettings:
    """Return ``goal`` with a catch in reach of the robot's cup, if that is stronger than the learner's.

    The constant acceleration that takes a cup beside the ball over d in t is 2 d / t^2; one that also has the ball's
    speed there accelerates and brakes, with twice as much.
    """
    strongest_m_s2 = max(goal.catch_acceleration_m_s2, 0.5 * catch.acceleration_m_s2)
    return dataclasses.replace(goal, catch_acceleration_m_s2=strongest_m_s2)
