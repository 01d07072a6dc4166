"""Identify: the friction in the joints that the arm's controller does not know, and how its servo follows."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from kendama_cli.artifacts.friction_model import FrictionModel
from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.devices.robot.compensated import CompensatedRobot
from kendama_cli.devices.robot.exchange_log import RememberingRobot
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.identification.kept_servo import servo_message
from kendama_cli.identification.servo import fit_servo
from kendama_cli.log.messages import WrenchMessage
from kendama_cli.plugins.identification.excitation import excitation
from kendama_cli.plugins.identification.friction_choice import FrictionSamples, choose_friction
from kendama_cli.plugins.identification.friction_samples import Samples
from kendama_cli.plugins.identification.messages import JointFrictionMessage
from kendama_cli.plugins.identification.recording import JointRecording, TrackedPath, circle, play, recorded
from kendama_cli.plugins.identification.settings import IdentifySettings
from kendama_cli.robot_model.friction import network_torque, parametric_torque
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransform, JointStates
from kendama_cli.schema.random_stream import random_stream
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.stages.interface import Metric, StageContext, StageResult, State

LOG_PERIOD_S = 0.02


class Identify:
    """Takes nothing but the hardware; gives the FrictionModel of its joints, with their servo."""

    def __init__(
        self, *, identify: IdentifySettings, hardware: HardwareSettings, robot: RobotSettings, game: GameSettings
    ) -> None:
        self._settings = identify
        self._hardware = hardware
        self._robot = robot
        self._game = game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Move the arm in two ways, fit on one, compare on the other; track a circle without and with the better model.

        ``tracking_rms_mm_before`` and ``_after`` are given after the drive's own delay, ``drive_delay_ms``, has been
        taken off: the same for both, that of the compensated motion. Raises StageError where an excited joint would
        leave its range or moves too little, HardwareError where the robot reports no efforts or fails.
        """
        settings = self._settings
        arm = RobotModel(self._robot, self._game.cup, self._game.gravity_m_s2)
        played = _PlayedMotions(ctx)
        with open_robot(self._hardware, self._robot, self._game) as robot:
            circling = circle(arm, settings, robot.period_s)
            exciting = {
                name: excitation(
                    arm, self._game, settings, duration_s=seconds, period_s=robot.period_s, rng=played.rng(name)
                )
                for name, seconds in (("train", settings.duration_s), ("held_out", settings.held_out_s))
            }
            samples = Samples(self._robot, self._game)
            recordings = [played.play(name, robot, motion) for name, motion in exciting.items()]
            training, held_out = (samples.of(one, settings.smoothing_s) for one in recordings)
            hidden, rng = settings.hidden_units, played.rng("network")
            model = choose_friction(arm.joint_names, training, held_out, hidden=hidden, rng=rng)
            servo = fit_servo(arm, recordings[0].sent_rad, recordings[0].position_rad, robot.period_s)
            model = dataclasses.replace(model, servo=servo)
            tracked = {
                name: TrackedPath(arm, circling.joints, played.play(name, one, circling.joints))
                for name, one in (("before", robot), ("after", CompensatedRobot(robot, model)))
            }
        _log_friction(ctx, held_out, model, robot.period_s)
        if servo is not None:
            ctx.log.write("/identify/servo", float(recordings[0].t_s[-1]), servo_message(servo))
        _log_paths(ctx, tracked)
        return StageResult(model, _metrics(model, tracked, circling.speed_m_s))


class _PlayedMotions:
    """Motions played one after the other; those that a killed run had finished are not played again."""

    def __init__(self, ctx: StageContext) -> None:
        self._ctx = ctx
        saved = ctx.restore() or {}
        self._seed = int(saved["seed"]) if saved else int(ctx.rng("identify").integers(2**62))
        names = dict.fromkeys(key.partition(".")[0] for key in saved if "." in key)
        self._done = {
            name: JointRecording(**{field.name: saved[f"{name}.{field.name}"] for field in fields(JointRecording)})
            for name in names
        }

    def rng(self, name: str) -> np.random.Generator:
        """Return a stream for ``name`` alone, so that a resumed run samples the same values as the killed one."""
        return random_stream(self._seed, name)

    def play(self, name: str, robot: Robot, motion: JointTrajectory) -> JointRecording:
        if name not in self._done:
            start_s = sum(float(one.t_s[-1]) for one in self._done.values())
            seed = int(self.rng(f"{name} body").integers(2**63))
            kept = RememberingRobot(robot)
            try:
                self._done[name] = play(kept, motion, seed)
            finally:  # where a fault breaks it off, as far as it went
                every = max(1, round(LOG_PERIOD_S / robot.period_s))
                self._log(recorded(kept.played), start_s, motion.joint_names, every)
            self._ctx.checkpoint(self._state, force=True)  # a real arm should not have to move again
        self._ctx.progress(len(self._done), 4)
        return self._done[name]

    def _log(self, recording: JointRecording, start_s: float, joint_names: tuple[str, ...], every: int) -> None:
        for k in range(0, len(recording.t_s), every):
            t_s = start_s + float(recording.t_s[k])
            joints = JointStates(
                names=joint_names,
                position_rad=recording.position_rad[k],
                velocity_rad_s=recording.velocity_rad_s[k],
                effort_nm=recording.effort_nm[k],
            )
            self._ctx.log.write("/identify/joints", t_s, joints)
            self._ctx.log.write("/identify/wrench", t_s, WrenchMessage(*recording.wrist_wrench[k].tolist()))

    def _state(self) -> State:
        return {"seed": self._seed} | {
            f"{name}.{field.name}": getattr(recording, field.name)
            for name, recording in self._done.items()
            for field in fields(JointRecording)
        }


def _log_friction(ctx: StageContext, samples: FrictionSamples, model: FrictionModel, period_s: float) -> None:
    """Log the held-out samples that count, with the friction of both models."""
    parametric = parametric_torque(model.parametric, samples.velocity_rad_s)
    network = network_torque(model.network, samples.velocity_rad_s, model.max_speed_rad_s)
    every = max(1, round(LOG_PERIOD_S / period_s))
    for k in range(0, len(samples.velocity_rad_s), every):
        for j in np.flatnonzero(samples.kept[k]):
            message = JointFrictionMessage(
                joint=model.joint_names[j],
                velocity_rad_s=samples.velocity_rad_s[k, j],
                friction_nm=samples.torque_nm[k, j],
                parametric_nm=parametric[k, j],
                network_nm=network[k, j],
            )
            ctx.log.write("/identify/friction", k * period_s, message)


def _log_paths(ctx: StageContext, tracked: Mapping[str, TrackedPath]) -> None:
    paths: dict[str, Array] = {"reference": tracked["after"].wanted_m}
    paths |= {name: path.reached_m for name, path in tracked.items()}
    for name, positions in paths.items():
        for t_s, position in zip(tracked["after"].t_s, positions, strict=True):
            ctx.log.write(f"/identify/tracking/{name}", float(t_s), FrameTransform("world", "cup", position))


def _metrics(model: FrictionModel, tracked: Mapping[str, TrackedPath], speed_m_s: float) -> dict[str, Metric]:
    delay_s = tracked["after"].delay_s()
    chosen = model.network_rms_nm if model.chosen == "network" else model.parametric_rms_nm
    servo = model.servo
    return {
        "model": model.chosen,
        "parametric_rms_nm": float(np.sqrt(np.mean(model.parametric_rms_nm**2))),
        "network_rms_nm": float(np.sqrt(np.mean(model.network_rms_nm**2))),
        **{f"tracking_rms_mm_{name}": 1e3 * path.rms_m(delay_s) for name, path in tracked.items()},
        "tracking_speed_m_s": speed_m_s,
        "drive_delay_ms": 1e3 * delay_s,
        "servo_lag_s": None if servo is None else float(np.median(servo.lag_s)),
        "servo_dead_time_s": None if servo is None else servo.dead_time_s,
        **{f"{name}_rms_nm": float(value) for name, value in zip(model.joint_names, chosen, strict=True)},
    }
