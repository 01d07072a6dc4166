"""Observers of the flying ball: their interface, and those that use the robot's own tracking."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.control.cup_cart import CartStep
from kendama_cli.control.position_tracker import PositionTracker, rope_angle_rad
from kendama_cli.control.settings import ObservationSettings
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.learning.state import SwingState
from kendama_cli.vision.detection.interface import Sighting
from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator


@dataclass(frozen=True)
class CatchPrediction:
    """Estimate at ``t_s``: the ball's descent through the rim plane, and through the catch's height.

    Times count from the rollout's start.
    """

    t_s: float
    rim: CatchPose
    catch: CatchPose


@dataclass(frozen=True)
class ObservedFrame:
    """Frame of a camera of mid-exposure ``t_s``, whose detection was ready for the command of ``used_s``."""

    t_s: float
    used_s: float
    camera: str
    sighting: Sighting | None


@dataclass(frozen=True)
class Picture:
    """Whole image (h, w, 3) uint8, blue, green, red."""

    t_s: float
    camera: str
    pixels: NDArray[np.uint8]


@dataclass
class ObservationLog:
    """Record of a game by its observer, besides the estimates."""

    frames: list[ObservedFrame] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    free_s: float | None = None
    """Time at which free flight was detected."""
    period_s: float = 1.0
    """Between two frames of a camera."""

    @property
    def seen(self) -> int:
        """Number of frames in which the ball was seen."""
        return sum(frame.sighting is not None for frame in self.frames)

    @property
    def latency_frames(self) -> float | None:
        """Latency from mid-exposure to the first command that knows of it, 95 % of the frames, in frames."""
        if not self.frames:
            return None
        return float(np.quantile([one.used_s - one.t_s for one in self.frames], 0.95)) / self.period_s


class FlightObserver(Protocol):
    """Observer of one game, control period by control period."""

    observed: ObservationLog
    tracked: bool
    """True if the ball's position is that of the robot's tracking, as late as that is."""

    def begin(self, seed: int, *, pictured: bool) -> None:
        """Begin a game; a simulated sensor draws its noise from ``seed``, ``pictured`` asks to keep whole images."""

    def swinging(self, step: CartStep) -> None:
        """Take a control period of the swing-up."""

    def flying(self, step: CartStep) -> CatchPrediction | None:
        """Take a control period from the goal to the catch; return the estimate, if there is a new one."""

    def without_goal(self) -> FlightObserver:
        """Return the observer of swings without a goal: free flight begins as the rope is seen to slacken."""


class MarkerObserver:
    """Observer of the ball's marker as the robot tracks it, from ``free_after_s`` after the goal on."""

    tracked = True

    def __init__(
        self, tracker: PositionTracker, settings: ObservationSettings, *, rim_m: float, catch_m: float
    ) -> None:
        self._tracker, self._estimator, self._settings = tracker, tracker.estimator, settings
        self._rim_m, self._catch_m = rim_m, catch_m
        self.begin(0, pictured=False)

    def begin(self, seed: int, *, pictured: bool) -> None:
        self._estimator.reset()
        self.observed = ObservationLog()

    def swinging(self, step: CartStep) -> None:
        self._goal_s = step.t_s

    def flying(self, step: CartStep) -> CatchPrediction | None:
        if step.t_s < self._goal_s + self._settings.free_after_s:
            return None
        self.observed.free_s = self.observed.free_s or step.t_s
        covariance = np.eye(3) * self._settings.position_sigma_m**2
        self._estimator.update_position(step.t_s, step.exchange.state.ball_in_world_m, covariance)
        return predict_catch(self._estimator, step.t_s, rim_m=self._rim_m, catch_m=self._catch_m)

    def without_goal(self) -> FlightObserver:
        return SlackeningObserver(self._tracker, self._settings, rim_m=self._rim_m, catch_m=self._catch_m)


class SlackeningObserver:
    """Observer of the ball's marker as the robot tracks it; ``tracker`` finds free flight in its positions."""

    tracked = True

    def __init__(
        self, tracker: PositionTracker, settings: ObservationSettings, *, rim_m: float, catch_m: float
    ) -> None:
        self._tracker = tracker
        self._from_rad = math.radians(settings.observe_from_deg)
        self._rim_m, self._catch_m = rim_m, catch_m
        self.begin(0, pictured=False)

    def begin(self, seed: int, *, pictured: bool) -> None:
        self._tracker.reset()
        self.observed = ObservationLog()

    def swinging(self, step: CartStep) -> None:
        state = step.state
        if abs(state.angle_rad) < self._from_rad or state.angle_rad * state.rate_rad_s <= 0:
            self._tracker.reset()
            return
        self._take(step)
        if self._tracker.found is not None:
            self.observed.free_s = step.t_s

    def flying(self, step: CartStep) -> CatchPrediction | None:
        self._take(step)
        return predict_catch(self._tracker.estimator, step.t_s, rim_m=self._rim_m, catch_m=self._catch_m)

    def without_goal(self) -> FlightObserver:
        return self

    def _take(self, step: CartStep) -> None:
        state = step.exchange.state
        self._tracker.update(step.t_s, state.ball_in_world_m, state.cup_in_world_m)


def predict_catch(estimator: CatchPoseEstimator, t_s: float, *, rim_m: float, catch_m: float) -> CatchPrediction | None:
    """Return the prediction of ``estimator`` at ``t_s``, or None until it has one."""
    rim, catch = estimator.catch(rim_m), estimator.catch(catch_m)
    return None if rim is None or catch is None else CatchPrediction(t_s, rim, catch)


RATE_PERIODS = 5
"""The angle's rate is taken over so many control periods."""


class WatchedFlight:
    """Flight that ``observer`` watches without a goal that ends the swing: the seen slackening of the rope does."""

    def __init__(self, observer: FlightObserver) -> None:
        self.observer = observer

    def begin(self, first: Exchange, seed: int) -> None:
        """Begin a motion with the state ``first``, at rest."""
        self.observer.begin(seed, pictured=False)
        self._start_s, self._flying = first.t_s, False
        self._angles: list[tuple[float, float]] = []

    def look(self, exchange: Exchange) -> CatchPrediction | None:
        """Take a control period; return the prediction, if there is a new one. Times count from the beginning."""
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
