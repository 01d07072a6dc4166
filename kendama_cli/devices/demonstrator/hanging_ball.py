"""A ball on a rope under a given motion of the hand: does it rise over the cup, and does it come down into it?

A coarse model for judging recordings, many ropes, tempos and directions of gravity at once; what a catch needs is told
by ``simulation``. The rope is massless and cannot stretch: where the ball would leave its reach it is put back, and
what of its relative velocity leads outward is lost (position-based dynamics, M. Mueller et al., VRIPHYS 2006).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from kendama_cli.motion.sampling import columns_at
from kendama_cli.physics.rim_crossing import CATCH_SHARE, falls
from kendama_cli.schema.arrays import Array

GRAVITY_M_S2 = 9.81
"""Where the person swung, on Earth; what a robot's game sets as its gravity is of no account here."""
STEP_S = 4e-3
ROPES_M = (0.32, 0.34, 0.36, 0.38, 0.40, 0.42)
"""The strings of kendamas, of small ones to those of robots' laboratories."""
TAUS = (0.94, 0.97, 1.0, 1.03, 1.06)
"""The model is coarse: what holds at one tempo alone is chance."""
RIM_M = 0.09
"""The rim and a ball's radius over the tie point."""
NEAR_M = 0.15
"""A ball that comes down so near can have been caught: cup, hand and model are off by that much together."""
SMOOTHING_S = 0.06
AFTER_S = 0.5


@dataclass(frozen=True)
class Rise:
    """Over all ropes and tempos: the share in which the ball rises over the rim, and that in which it comes down late
    in the motion and near the cup."""

    rising: float
    caught: float


def rise_of(t_s: Array, hand_m: Array, upward: Array) -> list[Rise]:
    """Simulate, for each direction that may be up, ``upward`` (k, 3), a ball that hangs at rest at first.

    ``t_s`` (n,) rises, ``hand_m`` (n, 3) is the cup.
    """
    path = _Path(t_s, hand_m)
    each = len(ROPES_M) * len(TAUS)
    up = np.repeat(np.asarray(upward, dtype=np.float64), each, axis=0)
    rope, tau = np.tile(np.array(list(product(ROPES_M, TAUS))), (len(upward), 1)).T
    hand = np.repeat(path.at(np.zeros(1)), len(up), axis=0)
    ball, speed = hand - up * rope[:, None], np.zeros_like(hand)
    height, risen, caught = -rope, np.zeros(len(up), dtype=bool), np.zeros(len(up), dtype=bool)
    for step in range(1, round((path.duration_s * max(TAUS) + AFTER_S) / STEP_S) + 1):
        inner_s = np.minimum(step * STEP_S / tau, path.duration_s)
        moved = path.at(inner_s)
        hand_speed, hand = (moved - hand) / STEP_S, moved
        speed = speed - (GRAVITY_M_S2 * STEP_S) * up
        ball = ball + STEP_S * speed
        away = ball - hand
        length = np.sqrt(np.einsum("ij,ij->i", away, away))
        along = away / length[:, None]
        outward = np.einsum("ij,ij->i", speed - hand_speed, along)
        taut = length > rope
        ball = np.where(taut[:, None], hand + along * rope[:, None], ball)
        speed = np.where((taut & (outward > 0))[:, None], speed - along * outward[:, None], speed)
        away = ball - hand
        before, height = height, np.einsum("ij,ij->i", away, up)
        risen |= height > RIM_M
        down = falls(before - RIM_M, height - RIM_M)
        if down.any():
            beside = np.linalg.norm(away - height[:, None] * up, axis=1)
            caught |= down & (beside < NEAR_M) & (path.share(inner_s) > CATCH_SHARE)
    shares = [(flags.reshape(-1, each).mean(axis=1)) for flags in (risen, caught)]
    return [Rise(float(a), float(b)) for a, b in zip(*shares, strict=True)]


class _Path:
    """The hand's path, smoothed and at rest after its end."""

    def __init__(self, t_s: Array, hand_m: Array) -> None:
        self.duration_s = float(t_s[-1] - t_s[0])
        grid = np.linspace(0.0, self.duration_s, len(t_s))
        even = columns_at(grid, t_s - t_s[0], hand_m)
        window = 2 * round(SMOOTHING_S / self.duration_s * (len(grid) - 1) / 2) + 1
        if 5 <= window <= len(grid):
            even = savgol_filter(even, window, 3, axis=0)
        self.at = CubicSpline(grid, even)
        way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(even, axis=0), axis=1))))
        self._grid, self._share = grid, way / max(float(way[-1]), 1e-9)

    def share(self, t_s: Array) -> Array:
        """Return the fraction of the whole path that is covered at ``t_s`` (k,)."""
        return np.asarray(np.interp(t_s, self._grid, self._share))
