"""Swings of the cup and what a fitted model says that the ball does meanwhile, as compiled code."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kendama_cli.learning.reward import Window as GoalWindow
from kendama_cli.learning.reward import in_window
from kendama_cli.motion.braking import BrakingLimiter, limited
from kendama_cli.physics.free_fall import fall_s
from kendama_cli.plugins.learners.open_loop import wanted
from kendama_cli.system.compiled import Array, compiled


class Cup(NamedTuple):
    """Cup that follows a swing: its limits, and the way it is played."""

    limiter: BrakingLimiter
    lowest_m_s2: float
    highest_m_s2: float
    edge_m: float
    ahead_s: float
    held: int
    steps: int


class Window(NamedTuple):
    """Times at which the ball may be released, and positions at which it may come down."""

    goal: GoalWindow
    gravity_m_s2: float
    rim_m: float
    landing_limit_m: float
    catch_acceleration_m_s2: float


@compiled
def place_of(angle: float, nodes: int) -> tuple[int, float, float]:
    """Return the node below |angle|, the fraction of the interval to the next one, and the angle's sign."""
    turned = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
    side = -1.0 if turned < 0.0 else 1.0
    place = abs(turned) / math.pi * (nodes - 1)
    node = min(int(place), nodes - 2)
    return node, place - node, side


@compiled
def acceleration(weights: Array, angle: float, rate: float, cup: float) -> float:
    """Return phi'' of the model: ``weights`` (4, n) of 1, phi'^2 (odd in the angle), phi', the cup's acceleration."""
    node, share, side = place_of(angle, weights.shape[1])
    total = 0.0
    for part in range(4):
        weight = (1.0 - share) * weights[part, node] + share * weights[part, node + 1]
        factor = side if part == 0 else (side * rate * rate if part == 1 else (rate if part == 2 else cup))
        total += weight * factor
    return total


@compiled
def add_features(into: Array, angle: float, rate: float, cup: float, by: float) -> None:
    """Add ``by`` times what ``acceleration`` multiplies the weights by to ``into`` (4, nodes)."""
    node, share, side = place_of(angle, into.shape[1])
    for part in range(4):
        factor = side if part == 0 else (side * rate * rate if part == 1 else (rate if part == 2 else cup))
        into[part, node] += by * (1.0 - share) * factor
        into[part, node + 1] += by * share * factor


@compiled
def _landing(x: float, v: float, rate: float, at: Array, window: Window) -> float:
    """Return the cost of a release on the right: the fraction of the cup's reach that the landing takes."""
    time = fall_s(at[4] - window.rim_m, rate * at[6], window.gravity_m_s2)
    if time == -math.inf:
        return 0.4
    apart = at[3] + rate * at[5] * time
    needed = abs(2.0 * apart / (time * time)) / window.catch_acceleration_m_s2
    reach = max(needed, abs(x + v * time + apart) / window.landing_limit_m)
    return float(-1.0 + 0.5 * min(reach, 2.5))


@compiled
def _cost(  # noqa: PLR0917
    swing: Array, start: Array, weights: Array, toy: Array, cup: Cup, window: Window
) -> float:
    """Return -1 for a release that leaves the cup nothing to do, -0.5 if it just gets there, above 0 without one."""
    x, v, angle, rate, highest, h = start[1], 0.0, start[0], 0.0, 0.0, cup.limiter.period_s
    asked = 0.0
    for k in range(cup.steps):
        if k % cup.held == 0:
            asked = wanted((swing[0], swing[1], swing[2]), k * h, x, v, cup.ahead_s)
            asked = max(cup.lowest_m_s2, min(cup.highest_m_s2, asked))
        sent = limited(cup.limiter, asked, x, v) * start[2]
        a1 = acceleration(weights, angle, rate, sent)
        a2 = acceleration(weights, angle + 0.5 * h * rate, rate + 0.5 * h * a1, sent)
        a3 = acceleration(weights, angle + 0.5 * h * rate + 0.25 * h * h * a1, rate + 0.5 * h * a2, sent)
        a4 = acceleration(weights, angle + h * rate + 0.5 * h * h * a2, rate + h * a3, sent)
        angle += h * rate + h * h / 6.0 * (a1 + a2 + a3)
        rate += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        x, v = x + h * v + 0.5 * h * h * sent, v + h * sent
        highest = max(highest, 0.5 * (1.0 - math.cos(angle)))
        if abs(x) > cup.edge_m or not abs(rate) < 50.0:
            return 1.0
        if in_window(window.goal, angle, rate):
            side = 1.0 if angle >= 0.0 else -1.0
            out, away = abs(angle), side * rate
            place = out / math.pi * (len(toy) - 1)
            node = min(int(place), len(toy) - 2)
            share = place - node
            at = (1.0 - share) * toy[node] + share * toy[node + 1]
            if -side * sent * at[0] - window.gravity_m_s2 * at[1] + rate * rate * at[2] <= 0.0:
                return _landing(side * x, side * v, away, at, window)
    return 1.0 - 0.5 * highest


@compiled
def costs(  # noqa: PLR0917 - plain arrays, as compiled code takes them
    swings: Array, starts: Array, weights: Array, toy: Array, cup: Cup, window: Window
) -> Array:
    """Return each swing's cost (n,): the mean over models ``weights`` (m, 4, nodes), each from ``starts`` (m, 3).

    A start is the ball's angle, the cup's place, and a factor on all accelerations.
    """
    found = np.zeros(len(swings))
    for i in range(len(swings)):
        for j in range(len(starts)):
            found[i] += _cost(swings[i], starts[j], weights[j], toy, cup, window) / len(starts)
    return found
