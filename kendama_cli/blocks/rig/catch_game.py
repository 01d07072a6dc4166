"""The second half of a game: free flight watched, the cup brought to where the ball comes down."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.artifacts.checks import Array
from kendama_cli.blocks.rig.cup_cart import CartStep, CupCart
from kendama_cli.blocks.rig.interception import Approach, approach
from kendama_cli.blocks.rig.swing_up import Swing
from kendama_cli.learning.limiter import BrakingLimiter
from kendama_cli.learning.reward import Flight
from kendama_cli.settings.transfer import CatchSettings, ObservationSettings
from kendama_cli.vision.catch_pose import CatchPoseEstimator

BELIEVED_READINGS = 5
"""Before that many readings of the flight the landing is computed from the last swing state."""


@dataclass(frozen=True)
class Foreseen:
    """The estimate as it stood at ``t_s``."""

    t_s: float
    pose: CatchPose


@dataclass(frozen=True)
class Game:
    """How one game went; ``steps`` holds the periods after the swing-up, times count from its start."""

    swing: Swing
    steps: tuple[CartStep, ...]
    estimates: tuple[Foreseen, ...]
    caught: bool
    crossing_m: Array | None
    """Where the tracked ball really fell through the rim plane (3,), None where it did not."""

    @property
    def swung_up(self) -> bool:
        """Whether the goal was reached."""
        return self.swing.outcome == "goal"

    def prediction_error_m(self, horizon_s: float) -> float | None:
        """Distance of the crossing from what was foreseen ``horizon_s`` before it, or as early as anything was."""
        if self.crossing_m is None or not self.estimates:
            return None
        early = [one for one in self.estimates if one.pose.t_s - one.t_s >= horizon_s] or [self.estimates[0]]
        return float(np.linalg.norm(early[-1].pose.position_m[:2] - self.crossing_m[:2]))


@dataclass(frozen=True)
class Court:
    """Where the game is played: the line's middle and direction (3,) in the world, heights, and what keeps the cup in.

    The cup is aimed at the ball's centre at ``catch_height_m``; ``rim_height_m`` is where the ball begins to touch.
    """

    middle_m: Array
    direction: Array
    catch_height_m: float
    rim_height_m: float
    flight: Flight
    limiter: BrakingLimiter

    def along(self, vector: Array) -> float:
        """The part of ``vector`` along the line."""
        return float(self.direction @ vector)


def finish_game(
    swing: Swing,
    cart: CupCart,
    court: Court,
    estimator: CatchPoseEstimator,
    *,
    observation: ObservationSettings,
    catch: CatchSettings,
) -> Game:
    """After ``swing`` watch the ball and catch it; raises HardwareError of the line."""
    if swing.outcome != "goal":
        return Game(swing, (), (), False, None)
    chase = _Chase(swing, cart, court, estimator, observation=observation, catch=catch)
    steps: list[CartStep] = []
    step = swing.steps[-1]
    while step.t_s < chase.catch_s + catch.watched_s:
        step = cart.step(chase.acceleration_m_s2(step), court.limiter)
        steps.append(step)
    crossing = crossing_m([one.exchange.state.ball_in_world_m for one in steps], court.rim_height_m)
    return Game(swing, tuple(steps), tuple(chase.estimates), step.exchange.state.caught, crossing)


def crossing_m(path_m: list[Array], height_m: float) -> Array | None:
    """Where a sampled path (n times (3,)) first falls through ``height_m``, linearly between samples."""
    for before, after in pairwise(path_m):
        if before[2] >= height_m > after[2]:
            share = (before[2] - height_m) / (before[2] - after[2])
            return np.asarray(before + share * (after - before))
    return None


class _Chase:
    """From readings of the flying ball to the cup's acceleration, period by period."""

    def __init__(
        self,
        swing: Swing,
        cart: CupCart,
        court: Court,
        estimator: CatchPoseEstimator,
        *,
        observation: ObservationSettings,
        catch: CatchSettings,
    ) -> None:
        self.estimates: list[Foreseen] = []
        self._cart, self._court, self._estimator, self._catch = cart, court, estimator, catch
        self._covariance = np.eye(3) * observation.position_sigma_m**2
        self._free_s = swing.duration_s + observation.free_after_s
        landing = court.flight.landing(swing.last)
        rate, angle = swing.last.rate_rad_s, swing.last.angle_rad
        self.catch_s = swing.duration_s + (landing.time_s if landing else 0.0)
        self._target_m = landing.x_m if landing else cart.x_m
        self._speed_m_s = swing.last.velocity_m_s + court.flight.rope_m * rate * math.cos(angle) if landing else 0.0
        self._approach: Approach | None = None
        self._readings = 0

    def acceleration_m_s2(self, step: CartStep) -> float:
        """What to ask of the cup for the period after ``step``."""
        if step.t_s >= self._free_s and step.t_s < self.catch_s:
            self._look(step)
        cart, catch = self._cart, self._catch
        end_s = self.catch_s - cart.lag_s
        if end_s - step.t_s > catch.settled_before_s:
            self._approach = approach(
                way_m=self._target_m - cart.x_m,
                velocity_m_s=cart.velocity_m_s,
                wanted_m_s=catch.matching * self._speed_m_s,
                start_s=step.t_s,
                end_s=end_s,
                limit_m_s2=catch.acceleration_m_s2,
            )
        if self._approach is not None and step.t_s < end_s:
            return self._approach.acceleration_m_s2(step.t_s + 0.5 * cart.period_s)
        stop = -cart.velocity_m_s / cart.period_s
        return min(max(stop, -catch.braking_m_s2), catch.braking_m_s2)

    def _look(self, step: CartStep) -> None:
        self._estimator.update_position(step.t_s, step.exchange.state.ball_in_world_m, self._covariance)
        self._readings += 1
        pose = self._estimator.catch(self._court.catch_height_m)
        if pose is None or self._readings < BELIEVED_READINGS:
            return
        rim = self._estimator.catch(self._court.rim_height_m)
        if rim is not None:
            self.estimates.append(Foreseen(step.t_s, rim))
        self.catch_s = pose.t_s
        self._target_m = self._court.along(pose.position_m - self._court.middle_m)
        self._speed_m_s = self._court.along(pose.velocity_m_s)
