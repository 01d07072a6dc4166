"""For how long a rope hung slack in a swing, from the logged ways of cup and ball."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.physics.rope import CupProfile
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.referee.cup_track import CupTrack

EVERY_S = 0.001


def swing_slack_s(game: GameSettings, rope_m: float, track: CupTrack, ball_m: Array, since_s: float = 0.0) -> float:
    """The longest time for which the rope of ``rope_m`` was slack before the flight, as in RolloutResult.

    ``ball_m`` (n, 3) is the ball's way at the times of ``track``. The flight is the slack time in which the ball first
    comes down through the rim's plane after ``since_s``, or the last one where it never does.
    """
    t_s = np.arange(track.t_s[0], track.t_s[-1], EVERY_S)
    apart = CubicSpline(track.t_s, ball_m - track.place_m)(t_s)
    axis = CubicSpline(track.t_s, track.axis)(t_s)
    up = np.sum(apart * axis, axis=1)
    across = np.linalg.norm(apart - up[:, None] * axis, axis=1)
    profile = CupProfile.of(game.cup)
    taut = np.array([profile.way_m(x, 0.0, z) > rope_m for x, z in zip(across, up, strict=True)])
    height = apart[:, 2] - game.cup.rim_m - game.ball.radius_m
    down = np.flatnonzero((height[:-1] > 0.0) & (height[1:] <= 0.0) & (t_s[1:] >= since_s))
    tight = np.flatnonzero(taut[: down[0] + 1] if len(down) else taut)
    return float((np.diff(tight).max(initial=1) - 1) * EVERY_S)
