"""Messages that the referee logs; standard library only."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class RefereeMessage:
    """One game under our physics and the referee's; a miss is nan where the ball never came down through the rim.

    ``swing_slack_s`` is the longest time for which our rope was slack before the flight, ``slack_in_swing`` whether
    that was long enough for the rope's mass to decide the miss.
    ``t_s`` (n,), ``cup_m``, ``cup_axis``, ``ours_m`` and ``referee_m`` (3 n): the way of the cup and of its axis, and
    the ball's under either; ``rope_m`` is the rope that the game was played with.
    """

    stage: str
    index: int
    ours_caught: bool
    referee_caught: bool
    ours_miss_m: float
    referee_miss_m: float
    swing_slack_s: float
    slack_in_swing: bool
    rope_m: float
    t_s: Collection[float]
    cup_m: Collection[float]
    cup_axis: Collection[float]
    ours_m: Collection[float]
    referee_m: Collection[float]


TOPICS: Mapping[str, type] = {"/referee/game": RefereeMessage}
