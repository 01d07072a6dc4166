"""The compiled arm alone, and a world in which DART finds friction and contacts together: referees for tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart import torque_kernel
from kendama_cli.simulation.dart.dynamics_kernel import ROTOR, ArmArrays, carry_rotors, move_chain
from kendama_cli.simulation.dart.rope_kernel import PIVOT, REACTION, SIDE
from kendama_cli.simulation.dart.world import ArmWorld


class CompiledArm:
    """Inertia H (n, n), bias C q' + g (n,), screws (n, 6) and points of ``arm`` after ``observe``."""

    def __init__(self, arm: RobotModel, game: GameSettings, *, links: bool = False) -> None:
        self.arrays = arrays = ArmArrays(arm, game, links=links)
        n = len(arm.joint_names)
        self._gravity_m_s2 = arm.gravity_m_s2
        self.inertia, self.bias, self.screws = np.zeros((n, n)), np.zeros(n), np.zeros((n, 6))
        self.points, self._speeds = np.zeros((n + len(arrays.marks), 3)), np.zeros_like(arrays.marks)

    def observe(self, position_rad: Array, velocity_rad_s: Array) -> None:
        constants = self.arrays.links, self.arrays.marks, self._gravity_m_s2
        found = self.inertia, self.bias, self.screws, self.points, self._speeds
        move_chain(position_rad, velocity_rad_s, *constants, *found)


def left_to_dart(world: ArmWorld) -> None:
    """Let DART find the friction of every step of ``world``, with its contacts; rotors are carried as told."""
    stepper, control, ball, n = world._stepper, world._control, world.ball, len(world.arm.joint_names)
    arm = CompiledArm(world.arm, ball.game)
    friction, drive = control.friction, control.drive

    def follow(
        reference: tuple[Array, Array, Array], _: Any, added: Any, state: tuple[Array, Array], t_s: float
    ) -> None:
        arm.observe(*state)
        control.effort_nm = effort = np.empty(n)
        torque_kernel.command(
            *reference, np.zeros(n), np.zeros(n) + added, *state, drive.state, drive.limits, control._gains[:3],
            friction.constants, friction.unknown, arm.inertia, arm.bias, effort, friction.level_nm,
        )  # fmt: skip
        for joint, level in zip(world.body.joints, friction.level_nm.tolist(), strict=True):
            joint.setCoulombFriction(0, level)
        force_n, at_m = ball.pulled[REACTION:PIVOT], ball.pulled[PIVOT:SIDE]
        viscous = friction.unknown[0] * friction.constants[torque_kernel.VISCOUS]
        load = effort - arm.bias - viscous * state[1]
        load += arm.screws @ np.concatenate([np.cross(at_m, force_n), force_n])
        change, force, step_s = np.zeros(n), effort.copy(), control._gains[2]
        torque_kernel.accelerations(
            arm.inertia, viscous, state[1], load, friction.level_nm, step_s, np.empty(n), change
        )
        carry_rotors(arm.screws, state[1], change, arm.arrays.links[:, ROTOR], force)
        world.body.skeleton.setForces(force)
        ball.pull(t_s)
        if ball.tension_n > 0.0:
            ball.react()
        world._stepper.world.step()

    stepper.follow = follow  # type: ignore[method-assign, assignment]
