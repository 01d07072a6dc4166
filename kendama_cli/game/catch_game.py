"""The second half of a game: free flight watched, the cup brought to where the ball comes down."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.game.cup_cart import CartStep, CupCart
from kendama_cli.game.cup_tilt import CupTilt
from kendama_cli.game.flight_observer import CatchPrediction, FlightObserver, ObservationLog
from kendama_cli.game.interception import InterceptionPlan, plan_interception
from kendama_cli.game.outcome import CatchOutcome, catch_outcome, held
from kendama_cli.game.settings import CatchSettings
from kendama_cli.game.swing_up import SwingUpRollout
from kendama_cli.game.tilt_plan import TiltPlan
from kendama_cli.learning.limiter import BrakingLimiter
from kendama_cli.learning.reward import Flight
from kendama_cli.schema.arrays import Array

FEWEST = 20
"""Samples from which a parabola is told."""
REST_S = 0.1
"""A game ends with the cup told to rest for so long: with whatever lag, the arm then does."""
AT_REST_M_S = 1e-9
FALL_M = 0.2
"""So high the ball is taken to fall as long as it has not been seen."""


@dataclass(frozen=True)
class Game:
    """How one game went; ``steps`` holds the periods after the swing-up, times count from its start."""

    swing: SwingUpRollout
    steps: tuple[CartStep, ...]
    estimates: tuple[CatchPrediction, ...]
    verdict: CatchOutcome | None
    """What the sensors told of the catch; None where the goal was not reached."""
    watched: ObservationLog
    crossing: Crossing | None
    """Where the tracked ball really fell through the rim plane, None where it did not."""

    @property
    def swung_up(self) -> bool:
        """Whether the goal was reached."""
        return self.swing.outcome == "goal"

    @property
    def caught(self) -> bool:
        """Whether the ball was in the cup in the end."""
        return self.verdict is not None and self.verdict.caught

    @property
    def outcome(self) -> str:
        """What happened, in words, with what went wrong in seeing it."""
        ended = "not swung up" if self.verdict is None else self.verdict.words
        return "; ".join([ended, *self.watched.troubles])

    def prediction_error_m(self, horizon_s: float) -> float | None:
        """Distance of the crossing from what was foreseen ``horizon_s`` before it, or as early as anything was."""
        if self.crossing is None or not self.estimates:
            return None
        early = [one for one in self.estimates if one.rim.t_s - one.t_s >= horizon_s] or [self.estimates[0]]
        return float(np.linalg.norm(early[-1].rim.position_m[:2] - self.crossing.place_m[:2]))


@dataclass(frozen=True)
class CatchGeometry:
    """Where the game is played: the line's middle and direction (3,) in the world, heights, and what keeps the cup in.

    The cup is aimed at the ball's centre at ``catch_height_m``; ``rim_height_m`` is where the ball begins to touch.
    """

    middle_m: Array
    direction: Array
    catch_height_m: float
    rim_height_m: float
    flight: Flight
    limiter: BrakingLimiter

    @property
    def below_rim_lever_m(self) -> float:
        """From the tie point up to where the ball is aimed at."""
        return self.catch_height_m - float(self.middle_m[2])

    def along(self, vector: Array) -> float:
        """The part of ``vector`` along the line."""
        return float(self.direction @ vector)


def finish_game(
    swing: SwingUpRollout,
    cart: CupCart,
    court: CatchGeometry,
    watch: FlightObserver,
    *,
    catch: CatchSettings,
    believed_sigma_m: float,
) -> Game:
    """After ``swing`` watch the ball and catch it; raises HardwareError of the line."""
    if swing.outcome != "goal":
        return Game(swing, (), (), None, watch.watched, None)
    chase = _CatchController(swing, cart, court, watch, catch=catch, believed_sigma_m=believed_sigma_m)
    steps: list[CartStep] = []
    step = swing.steps[-1]
    resting_s = 0.0
    while not (resting_s >= REST_S and (held(steps) or step.t_s >= chase.catch_s + catch.watched_s)):
        acceleration = chase.acceleration_m_s2(step)
        step = cart.step(acceleration, court.limiter, chase.lean(step))
        steps.append(step)
        resting_s = resting_s + cart.period_s if abs(cart.velocity_m_s) < AT_REST_M_S else 0.0
    path = np.array([[one.t_s, *one.exchange.state.ball_in_world_m] for one in steps])
    crossed = crossing(path, court.rim_height_m, watch.watched.free_s or 0.0)
    return Game(
        swing, tuple(steps), tuple(chase.estimates), catch_outcome(steps, chase.catch_s), watch.watched, crossed
    )


@dataclass(frozen=True)
class Crossing:
    """When and where (3,) the ball really fell through the rim plane."""

    t_s: float
    place_m: Array


def crossing(path: Array, height_m: float, free_s: float) -> Crossing | None:
    """Where a sampled path (n, 4) of t, x, y, z first falls through ``height_m`` after ``free_s``.

    By a parabola through the samples from then on up to the crossing, which takes their noise out; on the straight
    line between the two samples about it where there are few.
    """
    path = path[path[:, 0] >= free_s]
    fallen = np.flatnonzero((path[:-1, 3] >= height_m) & (path[1:, 3] < height_m))
    if not len(fallen):
        return None
    last = int(fallen[0])
    before, after = path[last], path[last + 1]
    straight = before + (before[3] - height_m) / (before[3] - after[3]) * (after - before)
    if last < FEWEST:
        return Crossing(float(straight[0]), straight[1:])
    s = path[: last + 1, 0] - before[0]
    curves = np.polynomial.polynomial.polyfit(s, path[: last + 1, 1:], 2)
    z0, fall, bend = curves[0, 2] - height_m, curves[1, 2], curves[2, 2]
    root = fall * fall - 4 * bend * z0
    if root < 0:
        return Crossing(float(straight[0]), straight[1:])
    late = (-fall - math.sqrt(root)) / (2 * bend)
    return Crossing(float(before[0] + late), curves[0] + late * (curves[1] + late * curves[2]))


class _CatchController:
    """From readings of the flying ball to the cup's acceleration, period by period."""

    def __init__(
        self,
        swing: SwingUpRollout,
        cart: CupCart,
        court: CatchGeometry,
        watch: FlightObserver,
        *,
        catch: CatchSettings,
        believed_sigma_m: float,
    ) -> None:
        self.estimates: list[CatchPrediction] = []
        self._cart, self._court, self._watch, self._catch = cart, court, watch, catch
        self._believed_sigma_m = believed_sigma_m
        self._lag_s = cart.lag_s  # as the swing-up has shown it: in flight only images and joint angles count
        landing = court.flight.landing(swing.last)
        rate, angle = swing.last.rate_rad_s, swing.last.angle_rad
        self.catch_s = swing.duration_s + (landing.time_s if landing else 0.0)
        self._target_m = landing.x_m if landing else cart.x_m
        self._speed_m_s = swing.last.velocity_m_s + court.flight.rope_m * rate * math.cos(angle) if landing else 0.0
        self._fall_m_s = -math.sqrt(2 * court.flight.gravity_m_s2 * FALL_M)
        self._approach: InterceptionPlan | None = None
        self._plan = TiltPlan(catch, cart.period_s)
        self._tilt_rad = 0.0

    def acceleration_m_s2(self, step: CartStep) -> float:
        """What to ask of the cup for the period after ``step``."""
        if step.t_s < self.catch_s:
            self._look(step)
        cart, catch = self._cart, self._catch
        end_s = self.catch_s - self._lag_s
        if end_s - step.t_s > catch.settled_before_s:
            self._approach = plan_interception(
                way_m=self._target_m - self._court.below_rim_lever_m * math.sin(self._tilt_rad) - cart.x_m,
                velocity_m_s=cart.velocity_m_s,
                wanted_m_s=catch.matching * self._speed_m_s,
                start_s=step.t_s,
                end_s=end_s,
                limit_m_s2=catch.acceleration_m_s2,
            )
            across = self._speed_m_s - self._approach.speed
            self._tilt_rad = self._plan.tilt_rad(np.array([across, self._fall_m_s + catch.give_m_s]))
        if self._approach is not None and step.t_s < end_s:
            return self._approach.acceleration_m_s2(step.t_s + 0.5 * cart.period_s)
        stop = -cart.velocity_m_s / cart.period_s
        return min(max(stop, -catch.braking_m_s2), catch.braking_m_s2)

    def lean(self, step: CartStep) -> CupTilt | None:
        """How the cup is to lean after that period; None where it stays on its line."""
        return None if self._plan.flat else self._plan.next(step.t_s, self.catch_s - self._lag_s, self._tilt_rad)

    def _look(self, step: CartStep) -> None:
        now = self._watch.flying(step)
        if now is None:
            return
        self.estimates.append(now)
        pose = now.catch
        if np.trace(pose.covariance_m2) > self._believed_sigma_m**2:
            return
        self.catch_s = pose.t_s
        self._target_m = self._court.along(pose.position_m - self._court.middle_m)
        self._speed_m_s = self._court.along(pose.velocity_m_s)
        self._fall_m_s = float(pose.velocity_m_s[2])
