"""The end of a swing-up: when the ball is released, and the flight after that, to the cup or beside it."""

from __future__ import annotations

import math

from kendama_cli.learning.reward import Flight, Goal
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.physics.free_fall import Landing
from kendama_cli.physics.rim_crossing import at_rim_m, falls, falls_in, is_caught
from kendama_cli.physics.taut_rope import Ball
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.engine import StepCallback, SwingEngine, state_of
from kendama_cli.simulation.swingup.rollout import Catch
from kendama_cli.simulation.swingup.workspace import catch_limiter, mouth_m

LONGEST_FLIGHT = 1000
"""Steps after which a flight is given up."""
SETTLING_S = 0.3
"""So long after coming down to the rim the ball must still be in a cup that touches it: a bounce out takes less."""


class Release:
    """Watcher of one rollout: told every step, it says when the swing-up is over, by the true state and rope."""

    def __init__(self, settings: LearnSettings, goal: Goal) -> None:
        desired = settings.goal
        self._goal = goal
        self._caught = desired.success == "caught"
        self._steps = max(1, round(desired.slack_s / settings.step_s))
        self._slack = 0
        self._lowest = 0.0 if goal.window.nearest_rad >= 0.5 * math.pi else -math.inf

    def after(self, swing: SwingEngine) -> bool:
        """Return True if the swing-up ends with this step."""
        if swing.above_m < self._lowest:
            self._slack = 0
            return False
        if not self._caught:
            return self._goal.reached(state_of(swing))
        slack = self._goal.in_window(state_of(swing)) and swing.tension_n == 0.0
        self._slack = self._slack + 1 if slack else 0
        return self._slack >= self._steps


def fly(
    swing: SwingEngine, settings: LearnSettings, game: GameSettings, since_s: float, on_step: StepCallback | None
) -> Catch:
    """Fly on: the cup heads for the landing, within its limits, until the ball is down at the rim again.

    The acceleration is planned anew in every step for a ball that falls freely; rope and air are in the dynamics.
    Where ball and cup touch, the cup then comes to rest, and the ball that came down into its mouth must stay in it
    (is_caught). Where they do not, the ball is caught whose centre comes down through the rim's plane so that the ball
    touches nothing.
    """
    radius_m = game.ball.radius_m
    flight, maximum, step_s = Flight.of(game), settings.goal.catch_acceleration_m_s2, settings.step_s
    limit = catch_limiter(settings).limit
    edge_m = settings.workspace.half_width_m if settings.workspace.kind == "terminate" else math.inf
    steps, at_rim = 0, None

    def advance(wanted_m_s2: float) -> None:
        nonlocal steps, at_rim
        before = swing.across_m, 0.0, swing.above_m - flight.rim_m
        sent = limit(max(-maximum, min(maximum, wanted_m_s2)), *swing.reference)
        swing.step(sent)
        now = swing.across_m, 0.0, swing.above_m - flight.rim_m
        if at_rim is None and falls(before[2] - radius_m, now[2] - radius_m):
            at_rim = at_rim_m(before, now)
        steps += 1
        if on_step is not None:
            on_step(since_s + steps * step_s, swing, sent)

    landing = _fall(swing, flight)
    while landing is not None and landing.time_s > 0.5 * step_s and steps < LONGEST_FLIGHT and abs(swing.x_m) <= edge_m:
        advance(landing.acceleration_m_s2)
        landing = _fall(swing, flight)
    miss_m, duration_s = abs(swing.across_m), steps * step_s
    if swing.in_cup is None:
        state = swing.x_m, swing.across_m, swing.above_m - flight.rim_m, swing.above_m_s
        return Catch(miss_m, duration_s, falls_in(*state, mouth_m=mouth_m(game), edge_m=edge_m, step_s=step_s))
    for _ in range(round(SETTLING_S / step_s)):
        advance(-swing.reference[1] / step_s)
    if at_rim is not None:
        miss_m = abs(at_rim[0])
    return Catch(miss_m, duration_s, is_caught(bool(swing.in_cup), at_rim, game.cup.radius_m))


def _fall(swing: SwingEngine, flight: Flight) -> Landing | None:
    ball = Ball(swing.across_m, swing.above_m, swing.across_m_s, swing.above_m_s)
    return flight.fall(swing.x_m, swing.velocity_m_s, ball)
