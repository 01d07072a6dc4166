"""Measure: rope and drag of the kendama, from a free swing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.devices.robot.exchange_log import RememberingRobot, exchange_message
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import ConfigError, InputError
from kendama_cli.plugins.identification.free_swing import free_swing
from kendama_cli.plugins.identification.messages import FreeSwingMessage
from kendama_cli.plugins.identification.settings import SwingMeasurement, TrackMeasurement
from kendama_cli.plugins.shared.kendama_fit import FreeSwing, KendamaFit, measure_kendama, swing_in_its_plane
from kendama_cli.plugins.shared.recordings.flight_reader import RecordedTrack, read_tracks
from kendama_cli.robot_model.placement.placement import cup_line
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.setup import SIGMAS_95
from kendama_cli.stages.interface import Metric, StageContext, StageResult

SPEED_M_S = 3.0
"""The speed at which the drag is told: about what the ball has when it leaves the rope."""


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
