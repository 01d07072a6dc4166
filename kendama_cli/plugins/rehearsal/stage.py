"""Rehearse: a motion on an arm for the first time, after the check and after the twin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory
from kendama_cli.control.imitation import require_same_joints, stretched
from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.devices.robot.rebuilt import open_simulated
from kendama_cli.errors import HardwareError, StageError
from kendama_cli.plugins.rehearsal.artifact import Rehearsal
from kendama_cli.plugins.rehearsal.settings import RehearseSettings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.motion_check import check_motion, require_allowed
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import JointStates
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings, SimulatedHardware
from kendama_cli.settings.placement import placed
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.safety import SafetySettings
from kendama_cli.stages.interface import StageContext, StageResult

PROGRESS_STEPS = 50
SAME_RAD = 1e-3
"""The arm carried out what was commanded where it sent no more than this beside it."""


class Rehearse:
    """Stage from the CatchMotion of ``adapt`` to a Rehearsal."""

    def __init__(
        self,
        *,
        rehearse: RehearseSettings,
        safety: SafetySettings,
        hardware: HardwareSettings,
        robot: RobotSettings,
        game: GameSettings,
    ) -> None:
        self._settings, self._safety = rehearse, safety
        self._hardware, self._robot, self._game = hardware, robot, game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Check, let the twin play, bring the arm slowly to the start, play; the measurements are stored in any
        case.

        Raises StageError, and moves nothing, where the check or the twin says no, or the arm has other joints;
        HardwareError where the arm fails before it has played anything. An arm that fails later is halted; the
        artifact says why and holds what was measured until then.
        """
        motion: CatchMotion = given["adapt"]
        settings = placed(self._robot, motion.placement)
        arm = RobotModel(settings, self._game.cup, self._game.gravity_m_s2)
        seed = int(ctx.rng("body").integers(2**62))
        with open_robot(self._hardware, settings, self._game) as robot:
            require_same_joints(robot, motion.joints)
            joints = stretched(motion.joints, 1.0 / self._settings.speed, robot.period_s)
            require_allowed(check_motion(arm, self._game, joints, self._safety))
            _require_limits(robot, joints)
            ghost = self._ghost(settings, robot.period_s, joints, seed, ctx)
            start = robot.reset(joints.position_rad[0], seed)
            played, stopped = self._play(robot, joints, start.state.position_rad, ctx)
        return self._made(joints, ghost, played, stopped)

    def _ghost(
        self, settings: RobotSettings, period_s: float, joints: JointTrajectory, seed: int, ctx: StageContext
    ) -> Array:
        """Return the joint angles (k, n) of the model's own arm under the same commands; raises StageError if it
        cannot follow.
        """
        with open_simulated(SimulatedHardware("simulated", period_s, None), settings, self._game) as twin:
            twin.reset(joints.position_rad[0], seed)
            exchanges = [twin.exchange(command) for command in _commands(joints)]
        for exchange, t_s in zip(exchanges, joints.t_s, strict=True):
            _log(ctx, "/rehearse/ghost", t_s, joints, exchange.state.position_rad, exchange.state.velocity_rad_s)
        reached = np.array([exchange.state.position_rad for exchange in exchanges])
        j, apart = _worst(reached - joints.position_rad)
        if not apart <= self._settings.max_twin_deviation_rad:
            raise StageError(
                f"the twin comes {apart:.3f} rad away from what is commanded in joint '{joints.joint_names[j]}'; "
                f"allowed: {self._settings.max_twin_deviation_rad:g} (rehearse.max_twin_deviation_rad); nothing was "
                "moved"
            )
        return reached

    def _play(
        self, robot: Robot, joints: JointTrajectory, before: Array, ctx: StageContext
    ) -> tuple[list[Exchange], str]:
        played: list[Exchange] = []
        total, maximum = len(joints.t_s), self._settings.max_tracking_error_rad
        for k, command in enumerate(_commands(joints)):
            try:
                exchange = robot.exchange(command)
                _require_numbers(joints, exchange.state.position_rad)
                played.append(exchange)
                _log_exchange(ctx, joints, exchange)
                j, tracking_error = _worst(exchange.state.position_rad - exchange.sent.position_rad)
                if tracking_error > maximum:
                    where = f"joint '{joints.joint_names[j]}' is {tracking_error:.3f} rad from where it was sent"
                    raise HardwareError(
                        f"{where}; allowed: {maximum:g} (rehearse.max_tracking_error_rad); the arm was halted"
                    )
            except HardwareError as error:
                robot.halt()
                if not played:
                    raise
                return played, str(error)
            if (k + 1) % PROGRESS_STEPS == 0 or k + 1 == total:
                ctx.progress(k + 1, total, t_s=round(exchange.t_s, 2), behind_rad=round(tracking_error, 4))
        return played, ""

    def _made(self, joints: JointTrajectory, ghost: Array, played: list[Exchange], stopped: str) -> StageResult:
        k = len(played)
        sent = np.array([one.sent.position_rad for one in played])
        measured = np.array([one.state.position_rad for one in played])
        tracking_error, deviation, limited = measured - sent, measured - ghost[:k], sent - joints.position_rad[:k]
        result = Rehearsal(
            joint_names=joints.joint_names,
            speed=self._settings.speed,
            t_s=np.array([one.t_s for one in played]),
            sent_rad=sent,
            measured_rad=measured,
            ghost_rad=ghost[:k],
            stopped=stopped,
        )
        metrics = {
            "speed": self._settings.speed,
            "completed": not stopped,
            "tracking_error_rms_mrad": 1e3 * float(np.sqrt((tracking_error**2).mean())),
            "tracking_error_max_mrad": 1e3 * _worst(tracking_error)[1],
            "twin_deviation_max_mrad": 1e3 * _worst(deviation)[1],
            "played_s": float(result.t_s[-1]),
        }
        warnings = [f"the arm stopped after {result.t_s[-1]:.2f} s: {stopped}"] if stopped else []
        j, away = _worst(limited)
        if away > SAME_RAD:
            warnings.append(
                f"the arm was sent up to {away:.3f} rad off its command in joint '{joints.joint_names[j]}': "
                "its own controller limited the motion, or periods were missed"
            )
        return StageResult(result, metrics, tuple(warnings))


def _require_limits(robot: Robot, joints: JointTrajectory) -> None:
    """Raise StageError where the motion is beyond the limits that the robot says it has."""
    limits = robot.limits
    beyond: tuple[tuple[str, Array, str], ...] = (
        ("speed", np.abs(joints.velocity_rad_s) - limits.velocity_rad_s, "rad/s"),
        ("acceleration", np.abs(joints.acceleration_rad_s2) - limits.acceleration_rad_s2, "rad/s^2"),
        ("upper stop", joints.position_rad - limits.upper_rad, "rad"),
        ("lower stop", limits.lower_rad - joints.position_rad, "rad"),
    )
    for what, over, unit in beyond:
        if float(over.max()) > 1e-9:
            joint = joints.joint_names[int(over.max(axis=0).argmax())]
            raise StageError(
                f"the robot itself allows less than its description: joint '{joint}' would be {over.max():.3f} {unit} "
                f"beyond its {what}; nothing was moved"
            )


def _require_numbers(joints: JointTrajectory, measured_rad: Array) -> None:
    """Raise HardwareError where a joint is measured nowhere."""
    wrong = np.flatnonzero(~np.isfinite(measured_rad))
    if len(wrong):
        name, value = joints.joint_names[wrong[0]], measured_rad[wrong[0]]
        raise HardwareError(f"joint '{name}' is measured at {value} rad; the arm was halted")


def _commands(joints: JointTrajectory) -> list[JointCommand]:
    rows = zip(joints.position_rad, joints.velocity_rad_s, joints.acceleration_rad_s2, strict=True)
    return [JointCommand(*row) for row in rows]


def _worst(difference: Array) -> tuple[int, float]:
    """Return the joint with the maximum of ``difference`` (..., n), and that maximum."""
    sizes = np.abs(difference).reshape(-1, difference.shape[-1]).max(axis=0)
    return int(sizes.argmax()), float(sizes.max())


def _log(ctx: StageContext, topic: str, t_s: float, joints: JointTrajectory, *values: Array) -> None:
    ctx.log.write(topic, float(t_s), JointStates(joints.joint_names, *values))


def _log_exchange(ctx: StageContext, joints: JointTrajectory, one: Exchange) -> None:
    _log(ctx, "/rehearse/sent", one.t_s, joints, one.sent.position_rad, one.sent.velocity_rad_s)
    state = one.state
    _log(ctx, "/rehearse/measured", one.t_s, joints, state.position_rad, state.velocity_rad_s, state.effort_nm)
    if state.external_nm is not None:
        _log(ctx, "/rehearse/external", one.t_s, joints, state.position_rad, state.velocity_rad_s, state.external_nm)
