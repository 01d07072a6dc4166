"""A free swing on a robot: the ball is swung up, the cup comes to rest, and the ball is watched."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.control.cup_cart import CartStep, CupCart
from kendama_cli.control.swing_state import SwingStateEstimator
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.errors import StageError
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.plugins.identification.settings import SwingMeasurement
from kendama_cli.plugins.shared.kendama_fit import FreeSwing, swing_in_its_plane
from kendama_cli.robot_model.placement.placement import CupLine
from kendama_cli.settings.game import GameSettings

SAMPLES_N = 8
"""Readings that the estimate of the ball's angle and rate is made from."""
RESTING_M_S = 1e-9
DIRECTION = np.array([1.0, 0.0, 0.0])


def free_swing(robot: Robot, line: CupLine, game: GameSettings, settings: SwingMeasurement, *, seed: int) -> FreeSwing:
    """Swing the ball up by its own energy, let it swing, and give its places relative to the resting cup.

    The rate of the pendulum's energy is -m l phi' cos(phi) a: the cup always accelerates with the sign that adds to
    it. Raises StageError where the ball does not reach the desired angle in time, HardwareError of the line.
    """
    estimator = SwingStateEstimator(
        robot.period_s, SAMPLES_N, line.home_m, DIRECTION, rope=TautRope.of(game), gravity_m_s2=game.gravity_m_s2
    )
    cart = CupCart(robot, line, estimator, game, 1.0)
    limiter = BrakingLimiter(
        half_width_m=settings.half_width_m,
        max_speed_m_s=settings.max_speed_m_s,
        braking_m_s2=BRAKING_SHARE * settings.acceleration_m_s2,
        max_m_s2=settings.acceleration_m_s2,
        period_s=robot.period_s,
    )
    step = _swung_up(cart, limiter, settings, cart.begin(seed))
    while abs(cart.velocity_m_s) > RESTING_M_S:
        stop = -cart.velocity_m_s / cart.period_s
        step = cart.step(max(-settings.acceleration_m_s2, min(settings.acceleration_m_s2, stop)), limiter)
    return _watched(cart, limiter, settings, step)


def _swung_up(cart: CupCart, limiter: BrakingLimiter, settings: SwingMeasurement, step: CartStep) -> CartStep:
    highest = 0.0
    while abs(step.state.angle_rad) < math.radians(settings.reach_deg):
        state = step.state
        highest = max(highest, abs(state.angle_rad))
        if step.t_s > settings.swing_up_s:
            raise StageError(
                f"the ball swung up to {math.degrees(highest):.0f} deg only within {settings.swing_up_s:g} s; "
                f"required: {settings.reach_deg:g} deg: raise measure.acceleration_m_s2, measure.half_width_m or "
                "measure.swing_up_s"
            )
        adding = state.rate_rad_s * math.cos(state.angle_rad)
        step = cart.step(-math.copysign(settings.acceleration_m_s2, adding or 1.0), limiter)
    return step


def _watched(cart: CupCart, limiter: BrakingLimiter, settings: SwingMeasurement, step: CartStep) -> FreeSwing:
    every = max(1, round(1.0 / (settings.rate_hz * cart.period_s)))
    begin_s, times, balls, cups = step.t_s, [], [], []
    number = 0
    while step.t_s - begin_s < settings.duration_s:
        step = cart.step(0.0, limiter)
        if number % every == 0:
            state = step.exchange.state
            times.append(step.t_s)
            balls.append(state.ball_in_world_m)
            cups.append(state.cup_in_world_m)
        number += 1
    return swing_in_its_plane(np.array(times), np.array(balls) - np.mean(cups, axis=0))
