"""An agent that is a function: it pumps energy into the ball, and shows what an entry point of agents names."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import gymnasium


def make(environment: gymnasium.Env[Any, Any], seed: int) -> Callable[[Any], Any]:
    """Return a function of an observation that accelerates the cup with the sign of -cos(angle) times the rate.

    ``seed`` has no effect.
    """
    space, straight_up = environment.action_space, environment.observation_space.high[2]  # type: ignore[attr-defined]

    def pump(observation: Any) -> Any:
        _, _, angle, rate, _ = observation.tolist()
        forward = math.cos(math.pi * angle / straight_up) * rate < 0.0
        if isinstance(space, gymnasium.spaces.Discrete):
            return int(space.n) - 1 if forward else 0
        return [1.0 if forward else -1.0]

    return pump
