"""Measure: rope and drag of the kendama, from a free swing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.control.cup_cart import CartStep, CupCart
from kendama_cli.control.swing_state import SwingStateEstimator
from kendama_cli.devices.robot.exchange_log import RememberingRobot, exchange_message
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import ConfigError, InputError, StageError
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.plugins.identification.messages import FreeSwingMessage
from kendama_cli.plugins.identification.settings import SwingMeasurement, TrackMeasurement
from kendama_cli.plugins.shared.kendama_fit import FreeSwing, KendamaFit, measure_kendama, swing_in_its_plane
from kendama_cli.plugins.shared.recordings.reader import RecordedTrack, read_tracks
from kendama_cli.robot_model.placement.placement import CupLine, cup_line
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.setup import SIGMAS_95
from kendama_cli.stages.interface import Metric, StageContext, StageResult

SPEED_M_S = 3.0
"""The speed at which the drag is told: about what the ball has when it leaves the rope."""
SAMPLES_N = 8
"""Readings that the estimate of the ball's angle and rate is made from."""
RESTING_M_S = 1e-9
DIRECTION = np.array([1.0, 0.0, 0.0])


class Measure:
    """Takes nothing but the hardware, or a track; gives the KendamaModel."""

    def __init__(
        self,
        *,
        measure: SwingMeasurement | TrackMeasurement,
        hardware: HardwareSettings,
        robot: RobotSettings,
        game: GameSettings,
    ) -> None:
        self._settings, self._hardware, self._robot, self._game = measure, hardware, robot, game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Swing and fit; raises StageError where the swing does not tell, and the errors of its source."""
        seed = int(ctx.rng("measure").integers(2**62))
        swing = self._swing(seed, ctx)
        fit = measure_kendama(swing, self._game)
        for t_s, seen, fitted in zip(fit.t_s, fit.seen_m, fit.fitted_m, strict=True):
            ctx.log.write("/measure/swing", float(t_s), FreeSwingMessage(*seen.tolist(), *fitted.tolist()))
        return StageResult(fit.kendama, _metrics(fit))

    def _swing(self, seed: int, ctx: StageContext) -> FreeSwing:
        settings = self._settings
        if isinstance(settings, TrackMeasurement):
            return _from_track(settings)
        line = cup_line(self._robot, self._game, settings.half_width_m)
        with open_robot(self._hardware, self._robot, self._game) as bare:
            robot = RememberingRobot(bare)
            try:
                return free_swing(robot, line, self._game, settings, seed=seed)
            finally:  # where a fault breaks it off, as far as it went
                for one in robot.played[1:]:
                    message = exchange_message(robot.joint_names, one)
                    ctx.log.write("/measure/exchange", one.t_s - robot.played[0].t_s, message)


def _from_track(settings: TrackMeasurement) -> FreeSwing:
    if settings.path is None:
        raise ConfigError("measure.path", "'measure.path' names no file; set measure.path=FILE")
    tracks = [one for one in read_tracks(Path(settings.path)) if settings.point in (None, one.name)]
    if not tracks:
        raise InputError(settings.path, f"it has no point '{settings.point}'", remedy="leave measure.point out")
    chosen = max(tracks, key=_extent_m)
    return swing_in_its_plane(chosen.t_s, chosen.position_m)


def _extent_m(track: RecordedTrack) -> float:
    return float(np.ptp(track.position_m[np.isfinite(track.position_m).all(axis=1)], axis=0).max(initial=0.0))


def _metrics(fit: KendamaFit) -> dict[str, Metric]:
    kendama = fit.kendama
    drag, sigma = kendama.drag_n_s_m(SPEED_M_S)
    sigmas = np.sqrt(kendama.drag_covariance.diagonal())
    return {
        "rope_mm": 1e3 * kendama.rope_m,
        "rope_mm_half_interval": SIGMAS_95 * 1e3 * kendama.rope_sigma_m,
        "linear_n_s_m": kendama.linear_n_s_m,
        "linear_half_interval": SIGMAS_95 * float(sigmas[0]),
        "quadratic_n_s2_m2": kendama.quadratic_n_s2_m2,
        "quadratic_half_interval": SIGMAS_95 * float(sigmas[1]),
        "drag_n_s_m_at_3": drag,
        "drag_at_3_half_interval": SIGMAS_95 * sigma,
        "amplitude_deg": math.degrees(kendama.amplitude_rad),
        "duration_s": kendama.duration_s,
        "rms_mm": 1e3 * kendama.rms_m,
    }


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
