"""Interact: an arm plays a script of poses and forces in a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.devices.robot.interface import ContactTruth, Robot, RobotState, TorqueExchange, torque_interface
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import StageError
from kendama_cli.log.messages import WrenchMessage
from kendama_cli.motion.rotation import quaternion_of
from kendama_cli.plugins.interact.artifact import InteractionResult
from kendama_cli.plugins.interact.impedance_law import TaskReference
from kendama_cli.plugins.interact.messages import ContactMessage
from kendama_cli.plugins.interact.open_controller import make_controller
from kendama_cli.plugins.interact.task_path import TaskPath
from kendama_cli.robot_model.joint_torque import TaskState
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransform, JointStates
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.interact import InteractionTask, InteractSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.scene import SceneSettings
from kendama_cli.simulation.dart.wrist import task_state
from kendama_cli.stages.interface import Metric, StageContext, StageResult

PROGRESS_STEPS = 500


class Interact:
    """Takes nothing; gives the InteractionResult of the script in ``interact``, played in ``scene`` by ``hardware``."""

    def __init__(
        self, *, interact: InteractSettings, scene: SceneSettings, robot: RobotSettings, hardware: HardwareSettings
    ) -> None:
        self._settings = interact
        self._scene = scene
        self._robot = robot
        self._hardware = hardware

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Play the script, and compare what the sensor felt that the tool exerted with what was wanted.

        ``force_error_*`` are along the wanted force over the steps throughout which it stays what it is, ``friction``
        is the median ratio of the contact's other part to it while the tool is moved in them, ``path_error_rms_mm`` is
        across it, over the whole script; None where no step is of that kind, or only a simulated robot would know.
        Raises ConfigError where a body of the scene holds the arm, HardwareError where the robot takes no torque
        commands or fails, StageError where the tool is left behind.
        """
        settings = self._settings
        seed = int(ctx.rng("body").integers(2**62))
        with open_robot(self._hardware, self._robot, InteractionTask(settings, self._scene)) as robot:
            arm = ProbeState(self._robot, settings, torque_interface(robot, "interact").period_s)
            arm.check_joints(robot)
            arm.take(robot.reset(arm.home_rad, seed).state, 0.0)
            torque = torque_interface(robot, "interact")
            path = TaskPath(settings.script, arm.state.tool_m, arm.state.tool_rotation)
            controller = make_controller(settings.controller)
            controller.reset(arm.state.position_rad)
            period_s = torque.period_s
            total = round(path.duration_s / period_s)
            every = max(1, round(1.0 / (period_s * settings.log_rate_hz)))
            played = _Played(robot.limits)
            for k in range(total):
                reference, step = path.at(k * period_s), path.step_at(k * period_s)
                exchange = torque.exchange(controller.command(arm.state, reference, period_s))
                arm.take(exchange.state, exchange.t_s)
                self._check_reached(arm, reference, step)
                played.note(step, reference, arm, exchange)
                if (k + 1) % every == 0:
                    _log(
                        ctx,
                        robot.joint_names,
                        arm.state,
                        exchange,
                        reference=reference,
                        step=settings.script[step].name,
                    )
                if (k + 1) % PROGRESS_STEPS == 0:
                    force_n = float(np.linalg.norm(arm.state.contact_n))
                    ctx.progress(k + 1, total, t_s=round(exchange.t_s, 1), force_n=round(force_n, 1))
        result = played.result(tuple(step.name for step in settings.script))
        return StageResult(result, played.metrics(path))

    def _check_reached(self, arm: ProbeState, reference: TaskReference, step: int) -> None:
        missing = reference.position_m - arm.state.tool_m
        missing = missing - float(reference.force_axis @ missing) * reference.force_axis
        error_m = float(np.linalg.norm(missing))
        if error_m > self._settings.max_error_m:
            place = f"[{', '.join(f'{value:.3f}' for value in reference.position_m)}]"
            raise StageError(
                f"step '{self._settings.script[step].name}' at {arm.t_s:.3f} s: the tool of {self._robot.called} is "
                f"{error_m:.3f} m from its reference {place} m; allowed: interact.max_error_m, "
                f"{self._settings.max_error_m}; move interact.script[{step}].position_m within reach, "
                "give it more time, or move what stands in the way",
            )


class _Played:
    """Record of the motion so far."""

    def __init__(self, limits: JointLimits) -> None:
        self._limits = limits
        self._rows: list[tuple[float, ...]] = []
        self._touched: set[str] = set()
        self._truthful = True
        self._effort_share = self._speed_share = 0.0

    def note(self, step: int, reference: TaskReference, arm: ProbeState, exchange: TorqueExchange) -> None:
        state, truth, limits = exchange.state, exchange.truth, self._limits
        parts = (arm.state.tool_m, reference.position_m, reference.force_n, reference.force_axis, arm.state.contact_n)
        self._truthful = self._truthful and truth is not None
        touched = "" if truth is None else truth.touched
        moves = float(reference.velocity.any())
        self._rows.append((exchange.t_s, step, moves, float(bool(touched)), *np.concatenate(parts)))
        self._touched |= {touched} - {""}
        self._effort_share = max(self._effort_share, float((np.abs(state.effort_nm) / limits.effort_nm).max()))
        speed = np.abs(state.velocity_rad_s) / limits.velocity_rad_s
        self._speed_share = max(self._speed_share, float(speed.max()))

    def result(self, steps: tuple[str, ...]) -> InteractionResult:
        t_s, step, _, _, tool, reference, wanted, _, contact = _columns(self._rows)
        return InteractionResult(
            steps, tuple(sorted(self._touched)), t_s[:, 0], step[:, 0], tool, reference, wanted, contact
        )

    def metrics(self, path: TaskPath) -> dict[str, Metric]:
        t_s, step, moves, touches, tool, reference, wanted, axis, contact = _columns(self._rows)
        along = (axis * contact).sum(axis=1)
        error = along - (axis * wanted).sum(axis=1)
        across = np.linalg.norm(contact - along[:, None] * axis, axis=1)
        settled = np.array([path.settled(int(index)) for index in step[:, 0]])
        sliding = settled & (moves[:, 0] > 0) & (touches[:, 0] > 0)
        missing = reference - tool
        missing -= (axis * missing).sum(axis=1)[:, None] * axis
        return {
            "force_error_rms_n": _rms(error[settled]),
            "force_error_n_p95": float(np.quantile(np.abs(error[settled]), 0.95)) if settled.any() else None,
            "force_error_max_n": float(np.abs(error[settled]).max()) if settled.any() else None,
            "contact_fraction": float(touches[settled].mean()) if settled.any() and self._truthful else None,
            "peak_force_n": float(np.linalg.norm(contact, axis=1).max()),
            "friction": float(np.median(across[sliding] / along[sliding])) if sliding.any() else None,
            "path_error_rms_mm": _rms(1e3 * np.linalg.norm(missing, axis=1)),
            "touched": ", ".join(sorted(self._touched)) or None,
            "effort_over_limit": self._effort_share,
            "speed_over_limit": self._speed_share,
            "duration_s": float(t_s[-1, 0]),
        }


def _columns(rows: list[tuple[float, ...]]) -> list[Array]:
    return np.split(np.array(rows), [1, 2, 3, 4, 7, 10, 13, 16], axis=1)


def _rms(values: Array) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if len(values) else None


def _log(
    ctx: StageContext,
    joint_names: tuple[str, ...],
    state: TaskState,
    exchange: TorqueExchange,
    *,
    reference: TaskReference,
    step: str,
) -> None:
    t_s, axis, sensed = exchange.t_s, reference.force_axis, exchange.state
    truth = exchange.truth or ContactTruth("", ())
    joints = JointStates(
        names=joint_names,
        position_rad=sensed.position_rad,
        velocity_rad_s=sensed.velocity_rad_s,
        effort_nm=sensed.effort_nm,
    )
    ctx.log.write("/interact/joints", t_s, joints)
    ctx.log.write("/interact/tool", t_s, _frame("tool", state.tool_m, state.tool_rotation))
    ctx.log.write("/interact/reference", t_s, _frame("reference", reference.position_m, reference.rotation))
    for body in truth.bodies:
        ctx.log.write("/interact/body", t_s, _frame(body.name, body.position_m, body.rotation))
    ctx.log.write("/interact/wrench", t_s, WrenchMessage(*sensed.wrist_wrench.tolist()))
    # where no force is wanted, whatever is felt counts as along it
    felt_n = state.contact_n
    along = float(axis @ felt_n) if axis.any() else float(np.linalg.norm(felt_n))
    across = float(np.linalg.norm(felt_n - along * axis)) if axis.any() else 0.0
    contact = ContactMessage(
        step=step, body=truth.touched, wanted_n=float(axis @ reference.force_n), along_n=along, across_n=across
    )
    ctx.log.write("/interact/contact", t_s, contact)


def _frame(child: str, place_m: Array, rotation: Array) -> FrameTransform:
    return FrameTransform("world", child, place_m, quaternion_of(rotation))


class ProbeState:
    """The arm with its probe after the last reading, ``state`` at ``t_s``.

    The contact's force is what the wrist's sensor reads, less the probe's weight, F = m g - R f (f being what the probe
    exerts on the tip link, in its frame), through a filter of first order and ``sensor_hz``; the probe's inertia is in.
    """

    state: TaskState
    t_s: float

    def __init__(self, robot: RobotSettings, interact: InteractSettings, period_s: float) -> None:
        self._model = RobotModel(robot, interact.probe, interact.gravity_m_s2)
        self._weight_n = interact.probe.mass_kg * np.array([0.0, 0.0, -interact.gravity_m_s2])
        self._share = 1.0 - math.exp(-2.0 * math.pi * interact.sensor_hz * period_s)
        self._felt_n = np.zeros(3)
        self.home_rad = self._model.home_rad

    def check_joints(self, robot: Robot) -> None:
        """Raise StageError, before anything moves, where ``robot`` has other joints than the model."""
        if robot.joint_names != self._model.joint_names:
            raise StageError(
                f"the robot has the joints {', '.join(robot.joint_names)}, the configured arm "
                f"{', '.join(self._model.joint_names)}: choose the robot's own description (robot=...); nothing moved"
            )

    def take(self, reading: RobotState, t_s: float) -> None:
        """Take the robot's reading at ``t_s``; the one at time 0 begins the filter at no contact."""
        turn = np.array(self._model.posed(reading.position_rad).tip.getWorldTransform().rotation())
        felt_n = self._weight_n - turn @ reading.wrist_wrench[:3]
        self._felt_n = np.zeros(3) if t_s == 0 else self._felt_n + self._share * (felt_n - self._felt_n)
        self.state = task_state(self._model, reading.position_rad, reading.velocity_rad_s, self._felt_n)
        self.t_s = t_s
