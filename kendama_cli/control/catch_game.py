"""A whole game, and its second half: the flight observed, the cup brought to where the ball comes down, and did."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.control.catch_controller import CatchController
from kendama_cli.control.catch_geometry import CatchGeometry
from kendama_cli.control.cup_cart import CartStep, CupCart
from kendama_cli.control.flight_observer import CatchPrediction, FlightObserver, ObservationLog
from kendama_cli.control.outcome import CatchOutcome, catch_outcome, held
from kendama_cli.control.settings import CatchSettings
from kendama_cli.control.swing_up import SwingUpRollout
from kendama_cli.physics.rim_crossing import falls
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

FEWEST_SAMPLES = 20
"""Samples from which a parabola is fitted."""


@dataclass(frozen=True)
class Crossing:
    """When and where (3,) the ball really fell through the rim plane."""

    t_s: float
    place_m: Array


def find_crossing(path: Array, height_m: float, free_s: float) -> Crossing | None:
    """Where a sampled path (n, 4) of t, x, y, z first falls through ``height_m`` after ``free_s``.

    By a parabola through the samples from then on up to the crossing, which takes their noise out; on the straight
    line between the two samples about it where there are few.
    """
    path = path[path[:, 0] >= free_s]
    height = path[:, 3] - height_m
    fallen = np.flatnonzero(falls(height[:-1], height[1:]))
    if not len(fallen):
        return None
    last = int(fallen[0])
    before, after = path[last], path[last + 1]
    straight = before + (before[3] - height_m) / (before[3] - after[3]) * (after - before)
    if last < FEWEST_SAMPLES:
        return Crossing(float(straight[0]), straight[1:])
    s = path[: last + 1, 0] - before[0]
    curves = np.polynomial.polynomial.polyfit(s, path[: last + 1, 1:], 2)
    z0, fall, bend = curves[0, 2] - height_m, curves[1, 2], curves[2, 2]
    root = fall * fall - 4 * bend * z0
    if root < 0:
        return Crossing(float(straight[0]), straight[1:])
    late = (-fall - math.sqrt(root)) / (2 * bend)
    return Crossing(float(before[0] + late), curves[0] + late * (curves[1] + late * curves[2]))


REST_S = 0.1
"""A game ends with the cup commanded to rest for so long: with whatever lag, the arm then does."""
AT_REST_M_S = 1e-9


@dataclass(frozen=True)
class Game:
    """How one game went; ``steps`` holds the periods after the swing-up, times count from its start."""

    swing: SwingUpRollout
    steps: tuple[CartStep, ...]
    estimates: tuple[CatchPrediction, ...]
    catch: CatchOutcome | None
    """What the sensors reported of the catch; None where the goal was not reached."""
    observed: ObservationLog
    crossing: Crossing | None
    """Where the tracked ball really fell through the rim plane, None where it did not."""

    @property
    def swung_up(self) -> bool:
        """Whether the goal was reached."""
        return self.swing.outcome == "goal"

    @property
    def caught(self) -> bool:
        """Whether the ball was caught, as in RolloutResult."""
        return self.catch is not None and self.catch.caught

    @property
    def outcome(self) -> str:
        """What happened, in words, with what went wrong in observing it."""
        ended = "not swung up" if self.catch is None else self.catch.words
        return "; ".join([ended, *self.observed.problems])

    def prediction_error_m(self, horizon_s: float) -> float | None:
        """Distance of the crossing from what was predicted ``horizon_s`` before it, or as early as anything was."""
        if self.crossing is None or not self.estimates:
            return None
        early = [one for one in self.estimates if one.rim.t_s - one.t_s >= horizon_s] or [self.estimates[0]]
        return float(np.linalg.norm(early[-1].rim.position_m[:2] - self.crossing.place_m[:2]))


def finish_game(
    swing: SwingUpRollout,
    cart: CupCart,
    geometry: CatchGeometry,
    observer: FlightObserver,
    *,
    game: GameSettings,
    catch: CatchSettings,
    max_sigma_m: float,
) -> Game:
    """After ``swing`` observe the ball and catch it; raises HardwareError of the line."""
    if swing.outcome != "goal":
        return Game(swing, (), (), None, observer.observed, None)
    controller = CatchController(swing, cart, geometry, catch=catch, max_sigma_m=max_sigma_m, tracked=observer.tracked)
    steps: list[CartStep] = []
    estimates: list[CatchPrediction] = []
    step = swing.steps[-1]
    resting_s = 0.0
    while not (resting_s >= REST_S and (held(steps) or step.t_s >= controller.catch_s + catch.after_catch_s)):
        if step.t_s < controller.catch_s and (prediction := observer.flying(step)) is not None:
            estimates.append(prediction)
            controller.follow(prediction)
        acceleration = controller.acceleration_m_s2(step.t_s)
        step = cart.step(acceleration, geometry.limiter, controller.tilt(step.t_s))
        steps.append(step)
        resting_s = resting_s + cart.period_s if abs(cart.velocity_m_s) < AT_REST_M_S else 0.0
    path = np.array([[one.t_s, *one.exchange.state.ball_in_world_m] for one in steps])
    since_s = observer.observed.free_s or 0.0
    crossing = find_crossing(path, geometry.rim_height_m, since_s)
    outcome = catch_outcome(steps, controller.catch_s, geometry.direction, game, since_s)
    return Game(swing, tuple(steps), tuple(estimates), outcome, observer.observed, crossing)
