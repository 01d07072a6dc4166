"""The laws of the rim: a ball's fall through its plane, which fall is the planned catch, and when a ball is caught."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.physics.rope import CupProfile
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings, GameSettings

SLACK_S = 0.02
"""A rope that is slack for less swings on as if it had been taut: the ball falls 2 mm in that time."""
CATCH_SHARE = 0.6
"""The catch ends a swing: so much of the cup's path lies before it (0.84 to 0.99 on recorded and bundled swings)."""
NEAR_M = 0.1
"""A ball comes down at the cup where it crosses the rim's plane within this of the axis."""
FITTED_S = 0.06
"""The end of a fall through which a parabola is fitted: so short that the cup's acceleration hardly changes."""
TAUT_SHARE = 0.95
"""A rope whose way to the ball is longer than this fraction of its length may be taut."""


def over_rim(apart_m: Any, axis: Any, rim_m: float) -> tuple[Any, Any, Any]:
    """Return the ball's place over the centre of the rim: x and y across the cup's axis, and the height along it [m].

    ``apart_m`` is the ball less the cup's position and ``axis`` the cup's unit axis, both in the world as x, y, z:
    three numbers or three arrays. x and y are the world's, turned with the axis the shortest way (Rodrigues' rotation
    of ``axis`` onto z): with c = axis_z and h = axis . apart,

        x' = x - axis_x (h + z) / (1 + c),   y' = y - axis_y (h + z) / (1 + c),   z' = h - rim.
    """
    (x, y, z), (a, b, c) = apart_m, axis
    height = a * x + b * y + c * z
    leaning = (height + z) / (1.0 + c + 1e-12)
    return x - a * leaning, y - b * leaning, height - rim_m


def falls(before_m: Any, after_m: Any) -> Any:
    """Return True where a height, a number or an array over some plane, falls through it."""
    return (before_m > 0.0) & (after_m <= 0.0)


def at_rim_m(before_m: Sequence[float], after_m: Sequence[float]) -> tuple[float, float]:
    """Return x and y where the straight line through two places over the rim (3,) reaches the rim's plane.

    The places are taken where the centre falls through the plane one ball radius above the rim: contact with the rim
    does not spoil them.
    """
    (x0, y0, z0), (x, y, z) = before_m, after_m
    left = z / max(z0 - z, 1e-6)
    return x + (x - x0) * left, y + (y - y0) * left


def catch_from_s(t_s: Array, cup_m: Array) -> float:
    """Return the time from which a descent can be the planned catch of the cup on its path (n, 3) at ``t_s`` (n,)."""
    path = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(cup_m, axis=0), axis=1))))
    return float(t_s[np.searchsorted(path, CATCH_SHARE * path[-1])])


def planned_descent(times_s: Sequence[float], since_s: float) -> int | None:
    """Return which descent is next to the planned catch: the first from ``since_s`` on, else the last before it."""
    after = [k for k, t_s in enumerate(times_s) if t_s >= since_s]
    return after[0] if after else len(times_s) - 1 if times_s else None


def near_descent(t_s: Array, cup_m: Array, over_m: tuple[Array, Array, Array]) -> int | None:
    """Return the sample (of n) before the descent to mark as the catch: that within NEAR_M of the axis; None without.

    ``cup_m`` (n, k) is the cup's path and ``over_m`` the ball over its rim (over_rim).
    """
    x, y, height = over_m
    near = np.hypot(x, y)[:-1] < NEAR_M
    down = np.flatnonzero(falls(height[:-1], height[1:]) & near).tolist()
    which = planned_descent([float(t_s[k + 1]) for k in down], catch_from_s(t_s, cup_m))
    return None if which is None else int(down[which])


def is_inside(place_m: Array, cup: CupSettings) -> bool:
    """Return True if a ball with its centre at ``place_m`` (3,), in the cup's own frame, is in it below the rim."""
    x, y, z = place_m.tolist()
    return bool(cup.floor_m < z < cup.rim_m and math.hypot(x, y) < cup.radius_m)


def is_caught(in_cup: bool, miss_m: tuple[float, float] | None, radius_m: float) -> bool:
    """Return True if the ball is in the cup at the end, and its descent next to the planned catch led into the mouth.

    ``miss_m`` is that descent's place at the rim beside the axis, ``radius_m`` the mouth's. A ball that is in the cup
    otherwise was caught later: off the rim, or on a second flight.
    """
    return in_cup and miss_m is not None and math.hypot(*miss_m) < radius_m


def falls_in(  # noqa: PLR0917 - plain numbers, as compiled code takes them
    x_m: float, across_m: float, over_m: float, rising_m_s: float, mouth_m: float, edge_m: float, step_s: float
) -> bool:
    """Return True if a step ends with the ball at the rim's plane, falling within the mouth of a cup that is inside.

    For a cup that the ball does not touch: at ``x_m`` within ``edge_m``, the ball ``across_m`` from its axis and
    ``over_m`` over its rim.
    """
    here = abs(over_m) <= step_s * abs(rising_m_s)
    return here and rising_m_s < 0.0 and abs(across_m) < mouth_m and abs(x_m) <= edge_m


@dataclass(frozen=True)
class SampledWays:
    """Sampled ways of cup and ball: times ``t_s`` (n,), places and the cup's unit axis (n, 3) in the world."""

    t_s: Array
    cup_m: Array
    axis: Array
    ball_m: Array

    def miss_m(self, game: GameSettings, since_s: float, rope_m: float = math.inf) -> tuple[float, float] | None:
        """Return x and y of the descent next to the catch that is planned from ``since_s`` on; None without one.

        A descent on a rope of ``rope_m`` that may be taut does not count, nor one that would reach the rim's plane
        farther out than that: a ball that grazes the plane hardly falls. A parabola through the last FITTED_S of the
        fall takes the noise out of tracked places.
        """
        over = np.column_stack(over_rim((self.ball_m - self.cup_m).T, self.axis.T, game.cup.rim_m))
        height, profile = over[:, 2] - game.ball.radius_m, CupProfile.of(game.cup)
        places = {
            int(k): self._at_rim(over, height, int(k))
            for k in np.flatnonzero(falls(height[:-1], height[1:]))
            if profile.path_length_m(over[k, 0], over[k, 1], over[k, 2] + game.cup.rim_m) <= TAUT_SHARE * rope_m
        }
        down = [k for k, place in places.items() if math.hypot(*place) <= rope_m]
        which = planned_descent([float(self.t_s[k + 1]) for k in down], since_s)
        return None if which is None else places[down[which]]

    def _at_rim(self, over: Array, height: Array, k: int) -> tuple[float, float]:
        first = k
        while first > 0 and height[first - 1] > 0.0 and self.t_s[k] - self.t_s[first - 1] < FITTED_S:
            first -= 1
        if k - first < 3:
            return at_rim_m(over[k], over[k + 1])
        s = self.t_s[first : k + 1] - self.t_s[k]
        position, slope, _ = np.polynomial.polynomial.polyfit(s, over[first : k + 1], 2)
        return at_rim_m(position - 1e-3 * slope, position)


@dataclass(frozen=True)
class SampledBody:
    """Parameters of a game that another physics needs beside its settings.

    ``drag`` are k1 [N s/m] and k2 [N s^2/m^2] of the ball in air, ``restitution`` the part of its speed that the ball
    keeps at the cup.
    """

    rope_m: float
    ball_kg: float
    drag: tuple[float, float]
    restitution: float
    rope_kg: float
