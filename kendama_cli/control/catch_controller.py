"""Controller of the catch: the cup's acceleration and tilt in every period, by observations of the flying ball."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.control.contact_lift import ContactLift
from kendama_cli.control.cup_cart import CupCart, CupTilt
from kendama_cli.control.flight_observer import CatchPrediction
from kendama_cli.control.interception import InterceptionPlan, plan_interception
from kendama_cli.control.settings import CatchSettings
from kendama_cli.control.swing_up import SwingUpRollout
from kendama_cli.learning.reward import Flight
from kendama_cli.learning.task_settings import GoalSettings
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings


@dataclass(frozen=True)
class CatchGeometry:
    """Centre and direction of the line (3,) in the world, heights, and the limiter that keeps the cup on the line.

    The cup is aimed at the ball's centre at ``catch_height_m``; ``rim_height_m`` is where the ball begins to touch.
    """

    center_m: Array
    direction: Array
    catch_height_m: float
    rim_height_m: float
    flight: Flight
    limiter: BrakingLimiter

    @property
    def below_rim_lever_m(self) -> float:
        """Height of the ball's aim over the tie point."""
        return self.catch_height_m - float(self.center_m[2])

    def along(self, vector: Array) -> float:
        """Return the part of ``vector`` along the line."""
        return float(self.direction @ vector)


def make_catch_geometry(
    center_m: Array, direction: Array, game: GameSettings, catch: CatchSettings, *, rope_scale: float, period_s: float
) -> CatchGeometry:
    """Return the geometry about ``center_m`` (3,), the tie point at x = 0, along the unit vector ``direction``.

    ``rope_scale`` is the real rope's length over the model's.
    """
    rim_m = float(center_m[2]) + game.cup.rim_m
    return CatchGeometry(
        center_m=np.asarray(center_m),
        direction=np.asarray(direction),
        catch_height_m=rim_m - catch.below_rim_m,
        rim_height_m=rim_m + game.ball.radius_m,
        flight=Flight.of(game, rope_scale),
        limiter=BrakingLimiter(
            half_width_m=catch.half_width_m,
            max_speed_m_s=catch.max_speed_m_s,
            braking_m_s2=BRAKING_SHARE * catch.acceleration_m_s2,
            max_m_s2=catch.acceleration_m_s2,
            period_s=period_s,
        ),
    )


def goal_here(goal: GoalSettings, catch: CatchSettings) -> GoalSettings:
    """Return ``goal`` with a catch in reach of the robot's cup, if that is stronger than the learner's.

    The constant acceleration that takes a cup beside the ball over d in t is 2 d / t^2; one that also has the ball's
    speed there accelerates and brakes, with twice as much.
    """
    strongest_m_s2 = max(goal.catch_acceleration_m_s2, 0.5 * catch.acceleration_m_s2)
    return dataclasses.replace(goal, catch_acceleration_m_s2=strongest_m_s2)


TILT_LIMIT_RAD_S2 = 60.0
UPRIGHT_AFTER_S = 0.4
"""The cup is upright again so long after the catch."""


class TiltPlan:
    """Tilt and lift from the goal to the end of the game, in steps of ``period_s``.

    Both are cubics that are planned anew at every call: the tilt reaches the desired one at the catch and rests there,
    the lift comes back to 0 there with the speed at which the cup yields, and is braked afterwards.
    """

    def __init__(self, catch: CatchSettings, period_s: float) -> None:
        self._catch, self._period_s = catch, period_s
        self._tilt, self._lift = [0.0, 0.0], [0.0, 0.0]
        self._turning = 0.0  # where nothing was planned in time, the cup stays as it is
        self._contact = ContactLift(catch, period_s)

    @property
    def flat(self) -> bool:
        """True if the settings ask for neither."""
        return self._catch.max_tilt_rad == 0.0 and self._catch.contact_speed_m_s == 0.0

    def tilt_rad(self, relative_m_s: Array) -> float:
        """Return the tilt that opens the cup against the ball's velocity relative to it (along the line, up) (2,)."""
        most = self._catch.max_tilt_rad
        return min(max(math.atan2(-relative_m_s[0], -relative_m_s[1]), -most), most)

    def next(self, t_s: float, end_s: float, tilt_rad: float) -> CupTilt:
        """Return tilt and lift at the end of the period that begins at ``t_s``; the cup meets the ball at ``end_s``."""
        catch, h = self._catch, self._period_s
        tilt, rate = self._tilt
        lift, rise = self._lift
        rising = self._contact.acceleration_m_s2(lift, rise, t_s, end_s)
        if end_s - t_s > catch.freeze_before_catch_s:
            self._turning = _planned(tilt_rad - tilt, rate, 0.0, span=(t_s, end_s), limit=TILT_LIMIT_RAD_S2, h=h)
        turning = self._turning
        if t_s >= end_s:
            end_s = max(end_s + UPRIGHT_AFTER_S, t_s + 4 * h)
            turning = _planned(-tilt, rate, 0.0, span=(t_s, end_s), limit=TILT_LIMIT_RAD_S2, h=h)
        self._tilt = [tilt + (rate + 0.5 * turning * h) * h, rate + turning * h]
        self._lift = [lift + (rise + 0.5 * rising * h) * h, rise + rising * h]
        return CupTilt(*self._lift, *self._tilt)


def _planned(
    displacement: float, speed: float, desired: float, *, span: tuple[float, float], limit: float, h: float
) -> float:
    """Return the mean acceleration of the coming period ``h`` on the cubic over ``span``, from its start to its end."""
    plan = plan_interception(
        displacement_m=displacement,
        velocity_m_s=speed,
        desired_m_s=desired,
        start_s=span[0],
        end_s=span[1],
        limit_m_s2=limit,
    )
    return plan.acceleration_m_s2(span[0] + 0.5 * h)


UNOBSERVED_FALL_M = 0.2
"""Height from which the ball is taken to fall until it has been seen."""


class CatchController:
    """Controller that plans the interception anew in every period, for where the ball is predicted to come down.

    Until the first prediction that is good enough, that is where the ballistic flight of the swing-up's last state
    lands. ``max_sigma_m`` is the standard deviation below which a prediction is followed. Positions that are
    ``tracked`` come as late as in the swing-up; images have the time at which they were taken.
    """

    def __init__(
        self,
        swing: SwingUpRollout,
        cart: CupCart,
        geometry: CatchGeometry,
        *,
        catch: CatchSettings,
        max_sigma_m: float,
        tracked: bool,
    ) -> None:
        self._cart, self._geometry, self._catch = cart, geometry, catch
        self._max_sigma_m = max_sigma_m
        self._lag_s = cart.delay_s if tracked else cart.arm_lag_s  # as the swing-up has shown it
        landing = geometry.flight.landing(swing.last)
        ball = geometry.flight.rope.ball(swing.last.angle_rad, swing.last.rate_rad_s)
        self.catch_s = swing.duration_s + (landing.time_s if landing else 0.0) - (cart.delay_s - self._lag_s)
        """Time of the catch, as it is predicted now."""
        self._target_m = landing.x_m if landing else cart.x_m
        self._speed_m_s = swing.last.velocity_m_s + ball.across_m_s if landing else 0.0
        self._fall_m_s = -math.sqrt(2 * geometry.flight.gravity_m_s2 * UNOBSERVED_FALL_M)
        self._interception: InterceptionPlan | None = None
        self._tilt_plan = TiltPlan(catch, cart.period_s)
        self._tilt_rad = 0.0

    def follow(self, prediction: CatchPrediction) -> None:
        """Aim at what is predicted now, where that is certain enough."""
        pose = prediction.catch
        if np.trace(pose.covariance_m2) > self._max_sigma_m**2:
            return
        self.catch_s = pose.t_s
        self._target_m = self._geometry.along(pose.position_m - self._geometry.center_m)
        self._speed_m_s = self._geometry.along(pose.velocity_m_s)
        self._fall_m_s = float(pose.velocity_m_s[2])

    def acceleration_m_s2(self, t_s: float) -> float:
        """Return the cup's acceleration for the period that begins at ``t_s``."""
        cart, catch = self._cart, self._catch
        end_s = self.catch_s - self._lag_s
        if end_s - t_s > catch.freeze_before_catch_s:
            self._interception = plan_interception(
                displacement_m=self._target_m - self._geometry.below_rim_lever_m * math.sin(self._tilt_rad) - cart.x_m,
                velocity_m_s=cart.velocity_m_s,
                desired_m_s=catch.matching * self._speed_m_s,
                start_s=t_s,
                end_s=end_s,
                limit_m_s2=catch.acceleration_m_s2,
            )
            across = self._speed_m_s - self._interception.speed_m_s
            self._tilt_rad = self._tilt_plan.tilt_rad(np.array([across, self._fall_m_s + catch.contact_speed_m_s]))
        if self._interception is not None and t_s < end_s:
            return self._interception.acceleration_m_s2(t_s + 0.5 * cart.period_s)
        stop = -cart.velocity_m_s / cart.period_s
        return min(max(stop, -catch.braking_m_s2), catch.braking_m_s2)

    def tilt(self, t_s: float) -> CupTilt | None:
        """Return the cup's tilt at the end of that period; None if it stays upright on its line."""
        return None if self._tilt_plan.flat else self._tilt_plan.next(t_s, self.catch_s - self._lag_s, self._tilt_rad)
