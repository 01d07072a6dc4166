"""Watching the ball of a motion that was planned: when to look for free flight, and what is predicted in it."""

from __future__ import annotations

from kendama_cli.control.cup_cart import CartStep
from kendama_cli.control.flight_observer import CatchPrediction, FlightObserver
from kendama_cli.control.rope_angle import rope_angle_rad
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.learning.state import SwingState

RATE_PERIODS = 5
"""The angle's rate is taken over so many control periods."""


class WatchedFlight:
    """Asks ``observer`` as a game does, without a goal that ends the swing: the seen slackening of the rope does."""

    def __init__(self, observer: FlightObserver) -> None:
        self.observer = observer

    def begin(self, first: Exchange, seed: int) -> None:
        """A motion begins with the state ``first``, at rest."""
        self.observer.begin(seed, pictured=False)
        self._start_s, self._flying = first.t_s, False
        self._angles: list[tuple[float, float]] = []

    def look(self, exchange: Exchange) -> CatchPrediction | None:
        """After a control period: the prediction, where there is a new one; its times count from the beginning."""
        t_s, state = exchange.t_s - self._start_s, exchange.state
        self._angles.append((t_s, rope_angle_rad(state.ball_in_world_m - state.cup_in_world_m)))
        del self._angles[:-RATE_PERIODS]
        (first_s, first), (_, angle) = self._angles[0], self._angles[-1]
        rate = (angle - first) / (t_s - first_s) if t_s > first_s else 0.0
        step = CartStep(t_s, SwingState(0.0, 0.0, angle, rate), 0.0, exchange)
        if not self._flying:
            self.observer.swinging(step)
            self._flying = self.observer.observed.free_s is not None
            return None
        return self.observer.flying(step)
