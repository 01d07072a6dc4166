"""Where a ball first comes down through the plane of a cup's rim, from sampled ways of both."""

from __future__ import annotations

import numpy as np

from kendama_cli.schema.arrays import Array


def rim_miss_m(
    t_s: Array, cup_m: Array, ball_m: Array, *, rim_m: float, radius_m: float, since_s: float
) -> float | None:
    """The ball's place along x from the cup's axis at its first crossing after ``since_s``; None without one.

    Ways (n, 3) at ``t_s`` (n,). As in RolloutResult: taken where the centre is ``radius_m`` above the rim, ``rim_m``
    over the cup's place, and carried on to it, so that contact with the rim does not spoil it.
    """
    apart = np.asarray(ball_m) - np.asarray(cup_m)
    height = apart[:, 2] - rim_m - radius_m
    down = np.flatnonzero((height[:-1] > 0.0) & (height[1:] <= 0.0) & (t_s[1:] >= since_s))
    if not len(down):
        return None
    k = int(down[0])
    share = height[k] / (height[k] - height[k + 1])
    slope = (apart[k + 1] - apart[k]) / (t_s[k + 1] - t_s[k])
    at = apart[k] + share * (apart[k + 1] - apart[k])
    return float(at[0] + slope[0] * radius_m / max(-slope[2], 1e-3))
