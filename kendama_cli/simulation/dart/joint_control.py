"""The arm's own control at every step: drive, computed torque, motors and friction of the joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Never

import numpy as np

from kendama_cli.artifacts.friction_model import ParametricFriction
from kendama_cli.errors import SimulationError
from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import step_kernel, torque_kernel
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.drive_kernel import Drive
from kendama_cli.simulation.dart.dynamics_kernel import ArmArrays


class JointFriction:
    """The friction of n joints of a DART skeleton by the law of ``friction`` (ParametricFriction).

    Viscous friction is DART's damping, which enters its motion implicitly. ``constants`` (5, n) and ``unknown``
    (2,) are the arrays on which the compiled law works (torque_kernel.efforts), which gives the level
    Fc + Fs exp(-(v / vs)^2) of the dry friction: up to it compiled code finds the torque (step_kernel.joint_forces),
    and DART none. The offset of ``friction`` is not used: nobody sets one.
    """

    def __init__(self, joints: Sequence[Any], friction: ParametricFriction, effort_nm: Array) -> None:
        self._joints = joints
        self._viscous_nm_s = friction.viscous_nm_s
        self.constants = np.stack(
            [
                friction.coulomb_nm,
                friction.stribeck_nm,
                1.0 / friction.stribeck_rad_s,
                friction.viscous_nm_s,
                effort_nm,
            ]
        )
        self.level_nm: Array = np.zeros(len(joints))
        for joint in joints:
            joint.setCoulombFriction(0, 0.0)  # a description may have given it one
        self.set_unknown(0.0, 0.0)

    def set_unknown(self, extra_nm: float, share: float) -> None:
        """Let the joints have ``extra_nm`` of Coulomb friction more, and ``share`` of all that is known on top."""
        factor = 1.0 + share
        self.unknown = np.array([factor, extra_nm])
        for joint, viscous in zip(self._joints, factor * self._viscous_nm_s, strict=True):
            joint.setDampingCoefficient(0, viscous)


REFERENCE_REMEDY = "check the reference and robot.stiffness_1_s2"


class JointControl:
    """Controller of the forces on the joints of ``body`` for a step of ``step_s``; every array is (n,).

    ``effort_nm`` is what the motors gave last; ``drive`` holds references to the joints' limits.
    """

    def __init__(self, arm: RobotModel, body: Body, arrays: ArmArrays, step_s: float) -> None:
        self._moved = arrays
        self._arm = arm
        self.friction = JointFriction(body.joints, arm.friction, arm.limits.effort_nm)
        self.drive = Drive(arm.limits, step_s)
        stiffness = arm.settings.stiffness_1_s2
        self._gains = np.array([stiffness, 2.0 * math.sqrt(stiffness), step_s, arm.gravity_m_s2])
        self.effort_nm = self._none = np.zeros(len(arm.joint_names))
        self.force_nm = np.zeros_like(self._none)
        self._arrays: tuple[Array, ...]

    def reset(self, position_rad: Array, velocity_rad_s: Array) -> None:
        """Begin at ``position_rad`` with ``velocity_rad_s``, the motors giving nothing."""
        self.drive.reset(position_rad, velocity_rad_s)
        self.effort_nm = np.zeros_like(self._none)

    def take(self, ball: TetheredBall) -> None:
        """Work from now on with ``ball``, its rope and errors as they are now."""
        arm, drive, friction = self._moved, self.drive, self.friction
        self._arrays = (
            arm.links, arm.marks, drive.limits, friction.constants, arm.radii, self._gains, friction.unknown, ball.rope,
            ball.numbers, drive.state, friction.level_nm, ball.pulled, ball.force_n, self.force_nm, ball.touch,
            arm.inertia, arm.bias, arm.screws, arm.points, arm.speeds,
        )  # fmt: skip

    def follow(  # noqa: PLR0917
        self,
        ball: TetheredBall,
        reference: tuple[Array, Array, Array],
        noise_rad: Array | float,
        added_nm: Array | float,
        state: tuple[Array, Array],
        t_s: float,
    ) -> Array | None:
        """Have the motors give the torque toward ``reference`` (places, speeds, accelerations) by ArmWorld.step's law.

        ``state`` is where the joints are and how fast. Compiled code finds friction and the rope's tension. Return the
        state after the step (step_kernel) where nothing can touch in it, nor a joint come to its limits; else None, and
        ``force_nm`` on the joints and the ball's ``force_n`` are left to DART. Raises SimulationError, naming the
        joint, where a torque would not be finite.
        """
        drive = self.drive
        noise = noise_rad if isinstance(noise_rad, np.ndarray) else self._filled(noise_rad)
        added = added_nm if isinstance(added_nm, np.ndarray) else self._filled(added_nm)
        self.effort_nm, after = np.empty(n := len(self._none)), np.empty(3 * n + 6)
        answer = step_kernel.step_forces(
            *reference, noise, added, *state, ball.position_m, ball.velocity_m_s, self.effort_nm, after, *self._arrays
        )
        drive.limited = bool(answer & torque_kernel.LIMITED)
        if answer > torque_kernel.NEAR + torque_kernel.LIMITED or answer & torque_kernel.NOT_FINITE:
            self._refuse(answer, ball, t_s)
        return None if answer & torque_kernel.NEAR else after

    def _refuse(self, answer: int, ball: TetheredBall, t_s: float) -> Never:
        if answer & torque_kernel.GONE:
            ball.abort(t_s)
        if answer & torque_kernel.NOT_FINITE:
            self._abort(self.effort_nm, "torque", REFERENCE_REMEDY, t_s)
        self._abort(np.full_like(self._none, np.nan), "friction", "check the masses of the robot's description", t_s)

    def _filled(self, value: float) -> Array:
        return np.full_like(self._none, value) if value else self._none

    def _abort(self, values: Array, what: str, remedy: str, t_s: float) -> Never:
        name = self._arm.joint_names[bad := int(np.argmin(np.isfinite(values)))]
        raise SimulationError(
            name,
            t_s,
            f"the {what} of joint '{name}' of {self._arm.settings.name} is {values[bad]} at {t_s:.3f} s; the "
            f"simulation stops: {remedy}",
        )
