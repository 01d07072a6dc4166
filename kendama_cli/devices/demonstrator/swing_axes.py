"""Doubts whether z points up and x lies in the swing's plane, by what a ball on a rope does under the hand's path.

The path alone does not show which direction is up. A ball does: under a person's swing it rises over the cup and comes
down near it, under the same path rotated it does not. So a recording is refused only where it is a swing under another
reading of its axes and none as declared; one mirrored or turned about z is a swing as good as its image, and adapt
searches in its own plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from kendama_cli.devices.demonstrator.recording import Recording
from kendama_cli.errors import InputError
from kendama_cli.motion.sampling import columns_at
from kendama_cli.physics.rim_crossing import CATCH_SHARE, falls
from kendama_cli.schema.arrays import Array

GRAVITY_M_S2 = 9.81
"""Gravity where the person swung, on Earth, whatever the robot's game sets."""
STEP_S = 4e-3
ROPES_M = (0.32, 0.34, 0.36, 0.38, 0.40, 0.42)
"""The strings of kendamas, of small ones to those of robots' laboratories."""
TAUS = (0.94, 0.97, 1.0, 1.03, 1.06)
"""The model is coarse: what holds at one time scale alone is chance."""
RIM_M = 0.09
"""The rim and a ball's radius over the tie point."""
NEAR_M = 0.15
"""A ball that comes down so near can have been caught: cup, hand and model are off by that much together."""
SMOOTHING_S = 0.06
AFTER_S = 0.5


@dataclass(frozen=True)
class Rise:
    """Fractions of ropes and time scales in which the ball rises over the rim, and comes down late and near the cup."""

    rising: float
    caught: float


def rise_of(t_s: Array, hand_m: Array, upward: Array) -> list[Rise]:
    """Simulate, for each direction that may be up, ``upward`` (k, 3), a ball that hangs at rest at first.

    ``t_s`` (n,) rises, ``hand_m`` (n, 3) is the cup.
    """
    path = _Path(t_s, hand_m)
    each = len(ROPES_M) * len(TAUS)
    up = np.repeat(np.asarray(upward, dtype=np.float64), each, axis=0)
    rope, timed = np.tile(np.array(list(product(ROPES_M, range(len(TAUS))))), (len(upward), 1)).T
    timed = timed.astype(int)
    steps = np.arange(round((path.duration_s * max(TAUS) + AFTER_S) / STEP_S) + 1)[:, None]
    inner_s = np.minimum(steps * STEP_S / np.array(TAUS), path.duration_s)  # (steps, taus)
    hands, shares = path.at(inner_s), path.share(inner_s)
    hand = hands[0, timed]
    ball, speed = hand - up * rope[:, None], np.zeros_like(hand)
    height, risen, caught = -rope, np.zeros(len(up), dtype=bool), np.zeros(len(up), dtype=bool)
    for step in range(1, len(steps)):
        moved = hands[step, timed]
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
            caught |= down & (beside < NEAR_M) & (shares[step, timed] > CATCH_SHARE)
    fractions = [(flags.reshape(-1, each).mean(axis=1)) for flags in (risen, caught)]
    return [Rise(float(a), float(b)) for a, b in zip(*fractions, strict=True)]


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
        path = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(even, axis=0), axis=1))))
        self._grid, self._share = grid, path / max(float(path[-1]), 1e-9)

    def share(self, t_s: Array) -> Array:
        """Return the fraction of the whole path that is covered at each ``t_s``."""
        return np.asarray(np.interp(t_s, self._grid, self._share))


UP = ("z", "-z", "y", "-y", "x", "-x")
DIRECTIONS = np.array([(0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0), (1, 0, 0), (-1, 0, 0)], dtype=np.float64)

SURE_RISE, SURE_CATCH = 0.9, 0.25
"""A swing: the ball rises with nearly every rope and time scale, and comes down near the cup with a quarter of them."""
DOUBTFUL_RISE, DOUBTFUL_CATCH = 0.65, 0.2
"""No swing: below these both. Between them nothing is said."""
NEVER_RISES = 0.1

MAX_S = 8.0
"""Longer recordings hold more than a swing; nothing is said of them."""
LATERAL_RATIO = 2.0
MIN_LATERAL_M = 0.03
TURNED_RAD = math.radians(8)
"""A plane turned by 8 degrees shortens x by 1 %, which moves a ball's miss by 40 mm."""


def check_axes(recording: Recording, strictness: str) -> list[str]:
    """Return doubts about the declared axes; raises InputError if ``strictness`` is ``refuse`` and they are certain."""
    if strictness == "off" or recording.t_s[-1] - recording.t_s[0] > MAX_S:
        return []
    doubt, certain = _doubt(recording.t_s, recording.position_m)
    if not doubt:
        return []
    if certain and strictness == "refuse":
        raise InputError(
            recording.path,
            doubt,
            remedy=f"{recording.axes_remedy}; if they are right, capture.plausible.axes=warn",
        )
    return [f"{doubt}; {recording.axes_remedy}"]


def _doubt(t_s: Array, position_m: Array) -> tuple[str, bool]:
    """Return a sentence about the axes, empty if there is no doubt, and True if it is certain."""
    (own,) = rise_of(t_s, position_m, DIRECTIONS[:1])
    if own.rising <= DOUBTFUL_RISE and own.caught <= DOUBTFUL_CATCH:
        others = rise_of(t_s, position_m, DIRECTIONS[1:])
        best = max(range(len(others)), key=lambda i: (others[i].caught, others[i].rising))
        if others[best].rising >= SURE_RISE and others[best].caught >= SURE_CATCH:
            up = UP[1 + best]
            return (
                f"z does not seem to point up: with {up} upward a ball on a rope rises over the cup and falls near "
                f"it, as declared it rises for {own.rising:.0%} of the ropes and time scales only",
                True,
            )
        if own.rising <= NEVER_RISES:
            return (
                f"with this motion a ball on a rope of 0.32 to 0.42 m never rises over the cup{_rate(t_s, position_m)}",
                False,
            )
    flat = position_m[:, :2] - position_m[:, :2].mean(axis=0)
    sizes, axes = np.linalg.eigh(flat.T @ flat / len(flat))
    widest = math.sqrt(max(float(sizes[1]), 0.0))
    heading = math.atan2(abs(float(axes[1, 1])), abs(float(axes[0, 1])))
    if widest < MIN_LATERAL_M or heading < TURNED_RAD:
        return "", False
    ratio = widest / max(math.sqrt(max(float(sizes[0]), 0.0)), 1e-9)
    if ratio > LATERAL_RATIO:
        return f"the swing's plane is turned by {math.degrees(heading):.0f} deg from x: so will the arm's be", False
    return "", False


def _rate(t_s: Array, position_m: Array) -> str:
    """Return what to say of the rate: a swing whose times are half or twice as long as they were is none."""
    for factor, text in ((0.5, "half as long: recorded at twice the rate?"), (2.0, "twice as long: at half the rate?")):
        (other,) = rise_of(factor * t_s, position_m, DIRECTIONS[:1])
        if other.rising >= SURE_RISE and other.caught >= SURE_CATCH:
            return f", but it does with times {text}"
    return ""
