"""Record of a try while it goes on, and the part of it that is a demonstration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.tries import COLUMNS
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.hand_world import HandWorld

STILL_CUP_M_S, STILL_BALL_M_S = 0.03, 0.08
"""Slower than this they are at rest, where the ball hangs."""
ASIDE_SHARE = 0.1
"""A ball within this share of the rope's length from under the cup hangs."""
LEAST_S, LEAST_WAY_M = 0.3, 0.05
"""Less is no swing, but a touch of the cup."""


@dataclass(frozen=True)
class RecordMoment:
    """State of a TryRecord at one moment while nothing is caught yet."""

    rows: int
    in_cup_since_s: float | None
    rest: int
    rest_before_highest: int
    highest_m: float


class TryRecord:
    """Looks at the world many times a second; tells when the ball is caught, and gives the samples to keep.

    A swing begins at the last moment of rest before the ball was highest: who swings, misses, waits and swings again
    without letting go gives one demonstration, not two in a row.
    """

    def __init__(self, caught_s: float) -> None:
        self._caught_s = caught_s
        self._rows: list[tuple[float, ...]] = []
        self._in_cup_since_s: float | None = None
        self._rest, self._rest_before_highest, self._highest_m = 0, 0, -np.inf
        self.caught = False

    def look(self, world: HandWorld) -> None:
        """Record the world as it is."""
        ball = world.ball
        x, y, z = ball.position_m.tolist()
        cup_x, cup_y, cup_z, tilt = world.place.tolist()
        self._rows.append((world.t_s, cup_x, cup_y, cup_z, tilt, x, y, z, ball.tension_n))
        hangs = z < cup_z and abs(x - cup_x) < ASIDE_SHARE * world.game.rope.length_m
        cup_m_s, ball_m_s = np.abs(ball.tie_m_s).max(), np.abs(ball.velocity_m_s).max()
        if hangs and cup_m_s < STILL_CUP_M_S and ball_m_s < STILL_BALL_M_S:
            self._rest = len(self._rows) - 1
        if z - cup_z > self._highest_m:
            self._highest_m, self._rest_before_highest = z - cup_z, self._rest
        if not ball.is_in_cup():
            self._in_cup_since_s = None
        elif self._in_cup_since_s is None:
            self._in_cup_since_s = world.t_s
        elif world.t_s - self._in_cup_since_s >= self._caught_s:
            self.caught = True

    def moment(self) -> RecordMoment:
        """Return the present state, to which ``go_back`` can return."""
        found = (self._in_cup_since_s, self._rest, self._rest_before_highest, float(self._highest_m))
        return RecordMoment(len(self._rows), *found)

    def go_back(self, to: RecordMoment) -> None:
        """Forget what was seen since that moment."""
        del self._rows[to.rows :]
        self._in_cup_since_s, self._rest = to.in_cup_since_s, to.rest
        self._rest_before_highest, self._highest_m = to.rest_before_highest, to.highest_m

    def samples(self, conditions: Conditions) -> Array | None:
        """Return the demonstration (n, columns of a try's file) in the robot's game; None if it is hardly a swing."""
        rows = np.array(self._rows[self._rest_before_highest :])
        if len(rows) < 2 or rows[-1, 0] - rows[0, 0] < LEAST_S or np.ptp(rows[:, 1:4], axis=0).max() < LEAST_WAY_M:
            return None
        half = rows[:, 4] / 2
        made = np.zeros((len(rows), len(COLUMNS)))
        made[:, 0] = (rows[:, 0] - rows[0, 0]) * conditions.time_scale
        made[:, 1:4] = rows[:, 1:4] / conditions.rope_scale
        made[:, 4], made[:, 6] = np.cos(half), np.sin(half)
        made[:, 8:11] = rows[:, 5:8] / conditions.rope_scale
        made[:, 11] = rows[:, 8] / conditions.gravity_share
        return made
