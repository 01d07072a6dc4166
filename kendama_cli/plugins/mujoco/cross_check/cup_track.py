"""The logged way of a cup as a referee carries it, at every step, and for how long the rope hung slack on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from kendama_cli.errors import InputError
from kendama_cli.physics.rope import CupProfile
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

EVERY_S = 0.001


def swing_slack_s(game: GameSettings, rope_m: float, track: CupTrack, ball_m: Array, since_s: float = 0.0) -> float:
    """Return the longest time for which the rope of ``rope_m`` was slack before the flight, as in RolloutResult.

    ``ball_m`` (n, 3) is the ball's way at the times of ``track``. The flight is the slack time in which the ball first
    comes down through the rim's plane after ``since_s``, or the last one where it never does.
    """
    t_s = np.arange(track.t_s[0], track.t_s[-1], EVERY_S)
    apart = CubicSpline(track.t_s, ball_m - track.place_m)(t_s)
    axis = CubicSpline(track.t_s, track.axis)(t_s)
    up = np.sum(apart * axis, axis=1)
    across = np.linalg.norm(apart - up[:, None] * axis, axis=1)
    profile = CupProfile.of(game.cup)
    taut = np.array([profile.path_length_m(x, 0.0, z) > rope_m for x, z in zip(across, up, strict=True)])
    height = apart[:, 2] - game.cup.rim_m - game.ball.radius_m
    down = np.flatnonzero((height[:-1] > 0.0) & (height[1:] <= 0.0) & (t_s[1:] >= since_s))
    tight = np.flatnonzero(taut[: down[0] + 1] if len(down) else taut)
    return float((np.diff(tight).max(initial=1) - 1) * EVERY_S)


FROM_REST: tuple[Literal["clamped"], Literal["not-a-knot"]] = ("clamped", "not-a-knot")
"""A game begins at rest: a spline's own first slope, of samples that tremble, would throw the ball."""
RECOIL_S = 0.15
"""An arm has taken up the ball's blow by then."""
FEWEST = 8
"""Samples from which a way is made."""


@dataclass(frozen=True)
class CupTrack:
    """A logged way: times ``t_s`` (n,) from 0, the cup's ``place_m`` (n, 3) and unit ``axis`` (n, 3) in the world.

    The cup is round, so that its turn about the axis is left out. Raises InputError for a track that is too short.
    """

    t_s: Array
    place_m: Array
    axis: Array

    def __post_init__(self) -> None:
        if len(self.t_s) < FEWEST:
            problem = f"a logged way of the cup has {len(self.t_s)} samples; at least {FEWEST} are needed"
            raise InputError("replay", problem, remedy="run the stage again with --force")

    def rigid(self, met_s: float) -> CupTrack:
        """Return the track of a cup that does not recoil from a ball met at ``met_s``: without RECOIL_S, but smooth."""
        kept = (self.t_s < met_s) | (self.t_s > met_s + RECOIL_S)
        return CupTrack(self.t_s[kept], self.place_m[kept], self.axis[kept])

    def carried(self, step_s: float) -> Carried:
        """Return the path every ``step_s``, by cubic splines through the samples."""
        n = int((self.t_s[-1] - self.t_s[0]) / step_s)
        t_s = self.t_s[0] + step_s * np.arange(n + 1)
        place = CubicSpline(self.t_s, self.place_m, bc_type=FROM_REST)
        axis = CubicSpline(self.t_s, self.axis, bc_type=FROM_REST)(t_s)
        axis /= np.linalg.norm(axis, axis=1)[:, None]
        turns = _upright_to(axis)
        step = (turns[:-1].inv() * turns[1:]).as_rotvec() / step_s
        rate = np.vstack([step[:1], 0.5 * (step[1:] + step[:-1]), step[-1:]])
        return Carried(
            t_s - t_s[0],
            place(t_s),
            place(t_s, 1),
            place(t_s, 2),
            np.roll(turns.as_quat(), 1, axis=1),
            rate,
            np.gradient(rate, step_s, axis=0),
        )


@dataclass(frozen=True)
class Carried:
    """The cup at every step: world place (n, 3) and its derivatives; ``turn_wxyz`` (n, 4), rates in the cup's frame."""

    t_s: Array
    place_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    turn_wxyz: Array
    rate_rad_s: Array
    turning_rad_s2: Array


def _upright_to(axis: Array) -> Rotation:
    """Return the smallest rotations that take z to ``axis`` (n, 3)."""
    across = np.cross([0.0, 0.0, 1.0], axis)
    size = np.linalg.norm(across, axis=1)
    angle = np.arctan2(size, axis[:, 2])
    return Rotation.from_rotvec(across * (angle / np.maximum(size, 1e-12))[:, None])
