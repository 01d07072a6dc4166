"""The goal of the swing-up and the rewards on the way, from plain states."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeVar

from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import GoalSettings, RewardSettings
from kendama_cli.physics.free_fall import Landing, landing
from kendama_cli.physics.taut_rope import Ball, TautRope
from kendama_cli.settings.game import GameSettings

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Numbers = TypeVar("Numbers", "float", "NDArray[np.float64]")
Outcome = Literal["goal", "missed", "timeout", "outside"]
"""How a rollout ends: with success, released and not caught, with time up, or (where that ends it) outside."""


@dataclass(frozen=True)
class Flight:
    """Free flight from a state with the ``rope`` just slack: tie point on z = 0, rim ``rim_m`` above it."""

    rope: TautRope
    rim_m: float
    gravity_m_s2: float

    @classmethod
    def of(cls, game: GameSettings, rope_scale: float = 1.0) -> Flight:
        """Return the flight of the game, with a rope ``rope_scale`` times as long."""
        return cls(TautRope.of(game, rope_scale), game.cup.rim_m, game.gravity_m_s2)

    def landing(self, state: SwingState) -> Landing | None:
        """Return the landing predicted from ``state``; None if the ball does not rise over the rim.

        The ball starts where the taut rope, which goes round the cup, has it at that angle, with the velocity that it
        has there beside the cup's, and falls freely; the air, which moves the landing by millimetres, is left out.
        """
        ball = self.rope.ball(state.angle_rad, state.rate_rad_s)
        return self.fall(state.x_m, state.velocity_m_s, ball)

    def fall(self, x_m: float, velocity_m_s: float, ball: Ball) -> Landing | None:
        """Return the landing of a ball that is wherever ``ball`` says from a cup at ``x_m``; None without one."""
        found = landing(x_m, velocity_m_s, ball, self.rim_m, self.gravity_m_s2)
        return found if found.time_s > 0.0 else None


class Window(NamedTuple):
    """Window of angle and angular velocity in which the swing-up's goal lies, on either side."""

    nearest_rad: float
    farthest_rad: float
    min_rate_rad_s: float
    max_rate_rad_s: float

    @classmethod
    def of(cls, goal: GoalSettings) -> Window:
        """Return that of the settings."""
        return cls(
            math.radians(goal.angle_deg - goal.tolerance_deg),
            math.radians(goal.angle_deg + goal.tolerance_deg),
            float(goal.min_rate_rad_s),
            float(goal.max_rate_rad_s),
        )


def in_window(window: Window, angle_rad: float, rate_rad_s: float) -> bool:
    """Return True if angle and rate lie in the window; a ball that moves away from hanging has both of one sign."""
    angle, away = (-angle_rad, -rate_rad_s) if angle_rad < 0.0 else (angle_rad, rate_rad_s)
    if not window.nearest_rad <= angle <= window.farthest_rad:
        return False
    return window.min_rate_rad_s <= away <= window.max_rate_rad_s


def within_reach(found: Landing, landing_limit_m: float, catch_acceleration_m_s2: float) -> bool:
    """Return True if there is a landing, and the cup gets there within these limits."""
    if found.time_s <= 0.0 or abs(found.x_m) > landing_limit_m:
        return False
    return abs(found.acceleration_m_s2) <= catch_acceleration_m_s2


class Goal:
    """The window of angle and angular velocity on either side, and what else a plain state shows of a success."""

    def __init__(self, settings: GoalSettings, flight: Flight) -> None:
        self._settings = settings
        self._flight = flight
        self.window = Window.of(settings)

    def in_window(self, state: SwingState) -> bool:
        """Return True if angle and rate lie in the window."""
        return in_window(self.window, state.angle_rad, state.rate_rad_s)

    def reached(self, state: SwingState) -> bool:
        """Return True if a plain state alone, as a robot observes it, shows that the swing-up is done.

        It lies in the window and, unless that is enough, a catch is predicted to be within reach as if the rope were
        slack. Where the ball has to be caught, the taut rope must also have no pull at this angle and rate (with a cup
        that does not accelerate), so that it is slack indeed; a simulation looks at the rope's tension itself.
        """
        desired = self._settings
        if not self.in_window(state):
            return False
        if desired.success == "reached":
            return True
        flight = self._flight
        if desired.success == "caught":
            min_tension_m_s2 = flight.rope.tension_m_s2(state.angle_rad, state.rate_rad_s, 0.0, flight.gravity_m_s2)
            if min_tension_m_s2 > 0.0:
                return False
        found = flight.landing(state)
        return found is not None and within_reach(found, desired.landing_limit_m, desired.catch_acceleration_m_s2)


def step_reward(settings: RewardSettings, x_m: Numbers) -> Numbers:
    """Return the reward of an action that has led to the cup's position ``x_m`` [m], a number or an array (n,)."""
    beyond_m = abs(x_m) - settings.displacement_free_m
    return settings.step - settings.displacement_per_m * beyond_m * (beyond_m > 0.0)


def final_reward(settings: RewardSettings, outcome: Outcome, miss_m: float | None = None) -> float:
    """Return the reward of a rollout's end; ``miss_m`` is how far from the cup's axis a missed ball came down."""
    if outcome == "missed" and miss_m is not None:
        return settings.missed * max(0.0, 1.0 - miss_m / settings.missed_range_m)
    return {
        "goal": settings.goal,
        "missed": settings.missed,
        "timeout": settings.timeout,
        "outside": settings.outside,
    }[outcome]
