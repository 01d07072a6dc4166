"""The goal of a movement primitive while the motion goes on, and after it.

Until tau the goal moves evenly, so that it is at g with the goal velocity when the motion ends (J. Kober, K. Muelling,
O. Kroemer, C. H. Lampert, B. Schoelkopf, J. Peters, "Movement templates for learning of hitting and batting", ICRA
2010). After tau it slows down smoothly to rest within ``ROLL_OUT`` of the duration. A goal velocity of zero is the
paper's resting goal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array

ROLL_OUT = 0.15
"""Share of the duration in which a goal that still moves at the end comes to rest, by half of that way."""


@dataclass(frozen=True)
class GoalPath:
    """The goal at n instants; every array is (n, k), derivatives are by s = t / tau."""

    position: Array
    rate: Array
    second: Array


def goal_path(share: Array, goal: Array, goal_rate: Array) -> GoalPath:
    """Return the goal at fraction ``share`` s (n,): g + g' (s - 1) up to s = 1, then rolling out to g + g' ROLL_OUT
    / 2.

    The rate then is g' (1 - u)^2 (1 + 2 u), u = (s - 1) / ROLL_OUT: it leaves g' and comes to rest without a jump
    of the acceleration. ``goal`` and ``goal_rate`` are (k,).
    """
    s = np.asarray(share, dtype=np.float64)[:, None]
    ahead = np.minimum(s - 1.0, 0.0)
    u = np.clip((s - 1.0) / ROLL_OUT, 0.0, 1.0)
    rolled = ROLL_OUT * (u - u**3 + u**4 / 2)
    rate = (1 - u) ** 2 * (1 + 2 * u)
    second = -6 * u * (1 - u) / ROLL_OUT
    return GoalPath(goal + goal_rate * (ahead + rolled), goal_rate * rate, goal_rate * second)
