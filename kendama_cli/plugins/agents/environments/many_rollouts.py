"""Many rollouts on the rail at once, as compiled code."""

from __future__ import annotations

import math

from kendama_cli.simulation.swingup.rail_kernel import (
    DUE,
    GOAL,
    LONGEST_FLIGHT,
    TIMEOUT,
    Record,
    advance,
    fly,
    is_caught,
)
from kendama_cli.system.compiled import Array, compiled


@compiled
def hold_each(  # noqa: PLR0917 - plain arrays, as compiled code takes them
    swings: Array,
    tallies: Array,
    taken: Array,
    ends: Array,
    misses: Array,
    wanted: Array,
    gains: Array,
    before: Array,
    delays: Array,
    rules: Record,
    catches: Record,
    steps: int,
    at_most: int,
) -> None:
    """Hold wanted[i] for ``steps`` in every rollout i that goes on (ends[i] is DUE), all in place.

    Until delays[i] steps are over, before[i] (m/s^2, gain), the action that was held last, takes effect. ``taken`` are
    the steps of each rollout, ``at_most`` ends it as TIMEOUT. Where a release is followed by a flight, misses[i] is how
    far beside the axis the ball came down; NaN for a catch. ``catches`` are the rules with the limits of the flight.
    """
    for i in range(len(swings)):
        if ends[i] != DUE:
            continue
        p, w, aim = rules[i].physics, rules[i].limits, rules[i].aim
        for k in range(steps):
            if k < delays[i]:
                ends[i] = advance(swings[i], tallies[i], before[i, 0], before[i, 1], p, w, aim)
            else:
                ends[i] = advance(swings[i], tallies[i], wanted[i], gains[i], p, w, aim)
            taken[i] += 1
            if ends[i] == DUE and taken[i] == at_most:
                ends[i] = TIMEOUT
            if ends[i] != DUE:
                break
        if ends[i] == GOAL:
            flown, flight = swings[i].copy(), catches[i].limits
            fly(flown, LONGEST_FLIGHT, aim.catch_acceleration_m_s2, p, flight)
            misses[i] = math.nan if is_caught(flown, aim.mouth_m, p, flight) else abs(flown[1] - flown[0])
        before[i, 0], before[i, 1] = wanted[i], gains[i]
