"""Conditions by which a player eases the game, and the map of the swing to the robot's game."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from kendama_cli.plugins.teleoperation.play.settings import EaseSettings
from kendama_cli.settings.game import GameSettings


@dataclass(frozen=True)
class Conditions:
    """The player's game as multiples of the robot's."""

    gravity_share: float = 1.0
    rope_scale: float = 1.0
    cup_scale: float = 1.0

    def within(self, ease: EaseSettings) -> Conditions:
        """Return the nearest conditions that ``ease`` allows."""
        shortest, longest = ease.rope_scale
        return Conditions(
            min(max(self.gravity_share, ease.min_gravity_fraction), 1.0),
            min(max(self.rope_scale, shortest), longest),
            min(max(self.cup_scale, 1.0), ease.max_cup_scale),
        )

    def game(self, robots: GameSettings) -> GameSettings:
        """Return the game that is simulated for the player."""
        return dataclasses.replace(
            robots,
            gravity_m_s2=robots.gravity_m_s2 * self.gravity_share,
            rope=dataclasses.replace(robots.rope, length_m=robots.rope.length_m * self.rope_scale),
            cup=dataclasses.replace(robots.cup, radius_m=robots.cup.radius_m * self.cup_scale),
        )

    @property
    def time_scale(self) -> float:
        """Return the factor of the player's times in the robot's game: sqrt(gravity_share / rope_scale).

        A pendulum whose lengths are multiplied by k and whose gravity by c moves alike in times multiplied by
        sqrt(k / c); here k = 1 / rope_scale and c = 1 / gravity_share. Exact but for air and the rope's stretch.
        """
        return math.sqrt(self.gravity_share / self.rope_scale)

    def words(self) -> str:
        """Return words for the head of a try's file and for the page."""
        named = {"gravity": self.gravity_share, "rope": self.rope_scale, "cup": self.cup_scale}
        played = ", ".join(f"{name} x {value:.2f}" for name, value in named.items() if value != 1.0) or "the real game"
        if self.gravity_share == self.rope_scale == 1.0:
            return played
        return f"{played}; kept for the robot's: lengths x {1 / self.rope_scale:.3f}, times x {self.time_scale:.3f}"
