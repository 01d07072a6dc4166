"""Interact: an arm plays a script of poses and forces in a scene."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kendama_cli.errors import ConfigError, StageError
from kendama_cli.log.messages import WrenchMessage
from kendama_cli.motion.rotation import quaternion_of
from kendama_cli.plugins.interact.artifact import InteractionResult
from kendama_cli.plugins.interact.interface import TaskReference
from kendama_cli.plugins.interact.messages import ContactMessage
from kendama_cli.plugins.interact.scene_settings import SceneSettings, StaticBody
from kendama_cli.plugins.interact.settings import InteractSettings, make_controller
from kendama_cli.plugins.interact.task_path import TaskPath
from kendama_cli.plugins.interact.world import ProbeWorld
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransform, JointStates
from kendama_cli.settings.hardware import HardwareSettings, SimulatedHardware
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.world import STEP_S
from kendama_cli.stages.interface import Metric, StageContext, StageResult

PROGRESS_STEPS = 500


class Interact:
    """Takes nothing; gives the InteractionResult of the script in ``interact``, played in ``scene``."""

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
        across it, over the whole script; None where no step is of that kind. Raises ConfigError where a body of the
        scene holds the arm, or the robot is not a simulated one, StageError where the tool is left behind.
        """
        settings, hardware = self._settings, self._hardware
        if not isinstance(hardware, SimulatedHardware):
            raise ConfigError(
                "hardware.kind",
                f"'hardware.kind' is '{hardware.kind}'; interact commands torques, which 'simulated' alone takes: "
                "choose hardware=simulated; nothing was moved",
            )
        world = ProbeWorld(self._robot, settings, self._scene, hardware.imperfection, ctx.rng("body"))
        path = TaskPath(settings.script, world.state.tool_m, world.state.tool_rotation)
        controller = make_controller(settings.controller)
        controller.reset(world.state.position_rad)
        total = round(path.duration_s / STEP_S)
        every = max(1, round(1.0 / (STEP_S * settings.log_rate_hz)))
        moving = [body.name for body in self._scene.bodies if not isinstance(body, StaticBody)]
        played, most = _Played(world.arm.limits), world.arm.limits.effort_nm
        for k in range(total):
            reference, step = path.at(k * STEP_S), path.step_at(k * STEP_S)
            command = controller.command(world.state, reference, STEP_S)
            world.step(dataclasses.replace(command, torque_nm=np.clip(command.torque_nm, -most, most)))
            self._check_reached(world, reference, step)
            played.note(step, reference, world)
            if (k + 1) % every == 0:
                _log(ctx, world, moving, reference=reference, step=settings.script[step].name)
            if (k + 1) % PROGRESS_STEPS == 0:
                force_n = float(np.linalg.norm(world.state.contact_n))
                ctx.progress(k + 1, total, t_s=round(world.t_s, 1), force_n=round(force_n, 1))
        result = played.result(tuple(step.name for step in settings.script))
        return StageResult(result, played.metrics(path))

    def _check_reached(self, world: ProbeWorld, reference: TaskReference, step: int) -> None:
        missing = reference.position_m - world.state.tool_m
        missing = missing - float(reference.force_axis @ missing) * reference.force_axis
        error_m = float(np.linalg.norm(missing))
        if error_m > self._settings.max_error_m:
            place = f"[{', '.join(f'{value:.3f}' for value in reference.position_m)}]"
            raise StageError(
                f"step '{self._settings.script[step].name}' at {world.t_s:.3f} s: the tool of {self._robot.called} is "
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
        self._effort_share = self._speed_share = 0.0

    def note(self, step: int, reference: TaskReference, world: ProbeWorld) -> None:
        state, limits = world.state, self._limits
        parts = (state.tool_m, reference.position_m, reference.force_n, reference.force_axis, state.contact_n)
        moves = float(reference.velocity.any())
        self._rows.append((world.t_s, step, moves, float(bool(world.touched)), *np.concatenate(parts)))
        self._touched |= {world.touched} - {""}
        self._effort_share = max(self._effort_share, float((np.abs(world.effort_nm) / limits.effort_nm).max()))
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
            "contact_fraction": float(touches[settled].mean()) if settled.any() else None,
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


def _log(ctx: StageContext, world: ProbeWorld, moving: Sequence[str], *, reference: TaskReference, step: str) -> None:
    t_s, axis, state = world.t_s, reference.force_axis, world.state
    joints = JointStates(
        names=world.arm.joint_names,
        position_rad=state.position_rad,
        velocity_rad_s=state.velocity_rad_s,
        effort_nm=world.effort_nm,
    )
    ctx.log.write("/interact/joints", t_s, joints)
    ctx.log.write("/interact/tool", t_s, _frame("tool", state.tool_m, state.tool_rotation))
    ctx.log.write("/interact/reference", t_s, _frame("reference", reference.position_m, reference.rotation))
    for name in moving:
        pose = world.scene.bodies[name].getWorldTransform()
        frame = _frame(name, np.array(pose.translation()), np.array(pose.rotation()))
        ctx.log.write("/interact/body", t_s, frame)
    ctx.log.write("/interact/wrench", t_s, WrenchMessage(*world.wrench.tolist()))
    # where no force is wanted, whatever is felt counts as along it
    felt_n = state.contact_n
    along = float(axis @ felt_n) if axis.any() else float(np.linalg.norm(felt_n))
    across = float(np.linalg.norm(felt_n - along * axis)) if axis.any() else 0.0
    contact = ContactMessage(
        step=step, body=world.touched, wanted_n=float(axis @ reference.force_n), along_n=along, across_n=across
    )
    ctx.log.write("/interact/contact", t_s, contact)


def _frame(child: str, place_m: Array, rotation: Array) -> FrameTransform:
    return FrameTransform("world", child, place_m, quaternion_of(rotation))
