"""The goal of the swing-up and the rewards on the way, from plain states."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeVar

from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import GoalSettings, RewardSettings
from kendama_cli.physics.taut_rope import Ball, TautRope
from kendama_cli.settings.game import GameSettings

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Numbers = TypeVar("Numbers", "float", "NDArray[np.float64]")
Outcome = Literal["goal", "missed", "timeout", "outside"]
"""How a rollout ends: with success, released and not caught, with time up, or (where that ends it) outside."""


@dataclass(frozen=True)
class Landing:
    """Where the ball comes down through the rim plane, when, and the constant acceleration that takes the cup there."""

    time_s: float
    x_m: float
    acceleration_m_s2: float


@dataclass(frozen=True)
class Flight:
    """Free flight from a state with the ``rope`` just slack: tie point on z = 0, rim ``rim_m`` above it."""

    rope: TautRope
    rim_m: float
    gravity_m_s2: float

    @classmethod
    def of(cls, game: GameSettings, rope_scale: float = 1.0) -> Flight:
        """That of the game, with a rope ``rope_scale`` times as long."""
        return cls(TautRope.of(game, rope_scale), game.cup.rim_m, game.gravity_m_s2)

    def landing(self, state: SwingState) -> Landing | None:
        """The landing predicted from ``state``, or None where the ball does not rise over the rim.

        The ball starts where the taut rope, which goes round the cup, has it at that angle, with the velocity that it
        has there beside the cup's, and falls freely; the air, which moves the landing by millimetres, is left out.
        """
        ball = self.rope.ball(state.angle_rad, state.rate_rad_s)
        return self.fall(state.x_m, state.velocity_m_s, ball)

    def fall(self, x_m: float, velocity_m_s: float, ball: Ball) -> Landing | None:
        """The landing of a ball that is wherever ``ball`` says from a cup at ``x_m``."""
        across_m, above_m, across_m_s, above_m_s = ball
        root = above_m_s * above_m_s + 2.0 * self.gravity_m_s2 * (above_m - self.rim_m)
        if root <= 0.0:
            return None
        time_s = (above_m_s + math.sqrt(root)) / self.gravity_m_s2
        if time_s <= 0.0:
            return None
        apart = across_m + across_m_s * time_s
        return Landing(
            time_s=time_s,
            x_m=x_m + velocity_m_s * time_s + apart,
            acceleration_m_s2=2.0 * apart / (time_s * time_s),
        )


class Goal:
    """The window of angle and angular velocity on either side, and what else a plain state shows of a success."""

    def __init__(self, settings: GoalSettings, flight: Flight) -> None:
        self._settings = settings
        self._flight = flight
        self._nearest = math.radians(settings.angle_deg - settings.tolerance_deg)
        self._farthest = math.radians(settings.angle_deg + settings.tolerance_deg)

    @property
    def nearest_rad(self) -> float:
        """Smallest |angle| that can be the goal [rad]."""
        return self._nearest

    def in_window(self, state: SwingState) -> bool:
        """Whether angle and rate lie in the window; a ball that moves away from hanging has both of one sign."""
        angle, rate = state.angle_rad, state.rate_rad_s
        if angle < 0.0:
            angle, rate = -angle, -rate
        wanted = self._settings
        if not self._nearest <= angle <= self._farthest:
            return False
        return wanted.min_rate_rad_s <= rate <= wanted.max_rate_rad_s

    def reached(self, state: SwingState) -> bool:
        """Whether a plain state alone, as a robot observes it, says that the swing-up is done.

        It lies in the window and, unless that is enough, a catch is predicted to be within reach as if the rope were
        slack. Where the ball has to be caught, the taut rope must also have no pull at this angle and rate (with a cup
        that does not accelerate), so that it is slack indeed; a simulation looks at the rope's pull itself.
        """
        wanted = self._settings
        if not self.in_window(state):
            return False
        if wanted.success == "reached":
            return True
        flight = self._flight
        if wanted.success == "caught":
            min_tension_m_s2 = flight.rope.min_tension_m_s2(state.angle_rad, state.rate_rad_s, 0.0, flight.gravity_m_s2)
            if min_tension_m_s2 > 0.0:
                return False
        landing = flight.landing(state)
        return (
            landing is not None
            and abs(landing.x_m) <= wanted.landing_limit_m
            and abs(landing.acceleration_m_s2) <= wanted.catch_acceleration_m_s2
        )


def step_reward(settings: RewardSettings, x_m: Numbers) -> Numbers:
    """Return the reward of an action that has led to the cup's position ``x_m`` [m], a number or an array (n,)."""
    beyond_m = abs(x_m) - settings.displacement_free_m
    return settings.step - settings.displacement_per_m * beyond_m * (beyond_m > 0.0)


def final_reward(settings: RewardSettings, outcome: Outcome, miss_m: float | None = None) -> float:
    """Return the reward of a rollout's end; ``miss_m`` is how far beside the cup's axis a missed ball came down."""
    if outcome == "missed" and miss_m is not None:
        return settings.missed * max(0.0, 1.0 - miss_m / settings.missed_range_m)
    return {
        "goal": settings.goal,
        "missed": settings.missed,
        "timeout": settings.timeout,
        "outside": settings.outside,
    }[outcome]
