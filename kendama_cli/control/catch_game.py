"""Game after its swing-up: the flight is observed, the cup brought to the descending ball, the outcome determined."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.control.catch_controller import CatchController, CatchGeometry
from kendama_cli.control.cup_cart import CartStep, CupCart
from kendama_cli.control.flight_observer import CatchPrediction, FlightObserver, ObservationLog
from kendama_cli.control.settings import CatchSettings
from kendama_cli.control.swing_up import SwingUpRollout
from kendama_cli.physics.rim_crossing import SampledWays, falls, is_caught
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

HELD_S = 0.25
"""A ball in the cup for so long stays there: a bounce that leaves it is over by then."""
BLOW_S = 0.08
"""The blow of the ball is sought this long about the predicted catch."""
BLOW_N = 2.0
"""A smaller change of the wrist's force from one reading to the next is the arm's own motion."""


@dataclass(frozen=True)
class CatchOutcome:
    """Outcome of a catch: what the ball sensor says in the end, since when, and the largest blow of the wrist.

    ``caught`` is as in RolloutResult; if the robot tracks no ball that came down, the sensor decides alone. The blow
    is the largest change of the wrist's force from one control period to the next, about the predicted catch.
    """

    caught: bool
    in_cup: bool
    since_s: float
    blow_n: float

    @property
    def words(self) -> str:
        """Outcome in words."""
        if self.caught:
            return "caught"
        if self.in_cup:
            return "in the cup, but not by the planned catch"
        return "struck the cup and left" if self.blow_n > BLOW_N else "passed by"


def held(steps: Sequence[CartStep]) -> bool:
    """Return True if the ball sensor has said for ``HELD_S`` that the ball is in the cup."""
    if not steps or not steps[-1].exchange.state.caught:
        return False
    return steps[-1].t_s - _since_s(steps) >= HELD_S


def sensed_catch(in_cup: bool, miss_m: tuple[float, float] | None, game: GameSettings) -> bool:
    """Return True if the ball sensor says ``in_cup`` and the tracked descent, where it is known, led into the mouth."""
    return in_cup and (miss_m is None or is_caught(in_cup, miss_m, game.cup.radius_m))


def catch_outcome(
    steps: Sequence[CartStep], catch_s: float, direction: Array, game: GameSettings, since_s: float
) -> CatchOutcome:
    """Return how the control periods after the swing-up (one at least) ended; the catch was predicted for ``catch_s``.

    The cup leans along ``direction`` (3,); descents count from ``since_s`` on.
    """
    lean = np.array([step.tilt_rad for step in steps])[:, None]
    axis = np.sin(lean) * direction + np.cos(lean) * [0.0, 0.0, 1.0]
    states = [step.exchange.state for step in steps]
    cup_m, ball_m = (np.array([getattr(one, f"{body}_in_world_m") for one in states]) for body in ("cup", "ball"))
    miss_m = SampledWays(np.array([step.t_s for step in steps]), cup_m, axis, ball_m).miss_m(game, since_s)
    forces = np.array([step.exchange.state.wrist_wrench[:3] for step in steps])
    times = np.array([step.t_s for step in steps])
    near = np.abs(times[1:] - catch_s) <= BLOW_S
    changes = np.linalg.norm(np.diff(forces, axis=0), axis=1)[near]
    caught, blow_n = sensed_catch(states[-1].caught, miss_m, game), float(changes.max()) if len(changes) else 0.0
    return CatchOutcome(caught, states[-1].caught, _since_s(steps), blow_n)


def _since_s(steps: Sequence[CartStep]) -> float:
    """Return the time since which the ball sensor says what it says in the end."""
    now = steps[-1].exchange.state.caught
    since = steps[-1].t_s
    for step in reversed(steps):
        if step.exchange.state.caught != now:
            break
        since = step.t_s
    return since


MIN_SAMPLES = 20
"""Samples from which a parabola is fitted."""


@dataclass(frozen=True)
class Crossing:
    """Time and position (3,) at which the ball really fell through the rim plane."""

    t_s: float
    position_m: Array


def find_crossing(path: Array, height_m: float, free_s: float) -> Crossing | None:
    """Return the first fall of a sampled path (n, 4) of t, x, y, z through ``height_m`` after ``free_s``.

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
    if last < MIN_SAMPLES:
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
    """Result of a game; ``steps`` holds the periods after the swing-up, times count from its start."""

    swing: SwingUpRollout
    steps: tuple[CartStep, ...]
    estimates: tuple[CatchPrediction, ...]
    catch: CatchOutcome | None
    """Outcome of the catch by the sensors; None if the goal was not reached."""
    observed: ObservationLog
    crossing: Crossing | None
    """Real fall of the tracked ball through the rim plane, None if it did not."""

    @property
    def swung_up(self) -> bool:
        """True if the goal was reached."""
        return self.swing.outcome == "goal"

    @property
    def caught(self) -> bool:
        """True if the ball was caught, as in RolloutResult."""
        return self.catch is not None and self.catch.caught

    @property
    def outcome(self) -> str:
        """Outcome in words, with what went wrong in observing it."""
        ended = "not swung up" if self.catch is None else self.catch.words
        return "; ".join([ended, *self.observed.problems])

    def prediction_error_m(self, horizon_s: float) -> float | None:
        """Return the distance of the crossing from its prediction ``horizon_s`` before it, or the earliest one."""
        if self.crossing is None or not self.estimates:
            return None
        early = [one for one in self.estimates if one.rim.t_s - one.t_s >= horizon_s] or [self.estimates[0]]
        return float(np.linalg.norm(early[-1].rim.position_m[:2] - self.crossing.position_m[:2]))


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
    """Observe the ball after ``swing`` and catch it; raises HardwareError of the line."""
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
