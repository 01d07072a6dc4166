"""A world in which DART makes every step and finds friction and contacts together: a referee for tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import torque_kernel
from kendama_cli.simulation.dart.dynamics_kernel import ROTOR, carry_rotors
from kendama_cli.simulation.dart.rope_kernel import PIVOT, REACTION, SIDE
from kendama_cli.simulation.dart.world import ArmWorld


def left_to_dart(world: ArmWorld) -> None:
    """Let DART make every step of ``world``, its friction with its contacts; rotors are carried as told."""
    control, ball, n, arm = world._control, world.ball, len(world.arm.joint_names), world._arrays
    friction, drive = control.friction, control.drive

    def follow(
        _: Any, reference: tuple[Array, Array, Array], __: Any, added: Any, state: tuple[Array, Array], t_s: float
    ) -> None:
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
        change, force, step_s = np.zeros(n), control.force_nm, control._gains[2]
        force[:] = effort
        torque_kernel.accelerations(
            arm.inertia, viscous, state[1], load, friction.level_nm, step_s, np.empty(n), change
        )
        carry_rotors(arm.screws, state[1], change, arm.links[:, ROTOR], force)
        ball.pull(t_s)
        if ball.tension_n > 0.0:
            ball.react()

    control.follow = follow  # type: ignore[method-assign, assignment]
