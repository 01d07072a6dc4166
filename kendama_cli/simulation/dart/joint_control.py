"""The arm's own control at every step: drive, computed torque or a commanded one, motors and friction of the joints."""

from __future__ import annotations

import math
from typing import Never

import numpy as np

from kendama_cli.errors import SimulationError
from kendama_cli.motion.impedance import JointTorque
from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart import joint_kernel as kernel
from kendama_cli.simulation.dart.drive import Drive
from kendama_cli.simulation.dart.joint_friction import JointFriction
from kendama_cli.simulation.dart.task_state import coriolis_nm

MAY_STOP_STEPS = 2.0
"""A joint that its acceleration limit could stop within this many steps is left to DART's friction constraint."""
FAR_RAD_S = 1e4
"""A joint faster than this has left the domain of the model."""
TORQUE_REMEDY = "lower interact.controller.stiffness_n_m, or check the script"


class JointControl:
    """What sets the forces on the joints of ``body`` for a step of ``step_s``; every array is (n,).

    ``effort_nm`` is what the motors gave last; ``drive`` holds references to the joints' limits.
    """

    def __init__(self, arm: RobotModel, body: Body, *, always_held: bool, step_s: float) -> None:
        """In contact any joint may stop within a step, so that all are ``always_held`` by DART's constraint there."""
        self._arm, self._skeleton = arm, body.skeleton
        slow, change = MAY_STOP_STEPS * step_s * arm.limits.acceleration_rad_s2, step_s * arm.mobility(arm.home_rad)
        if always_held:
            slow, change = np.full_like(slow, np.inf), np.zeros_like(slow)
        self.friction = JointFriction(
            body.joints, arm.friction, arm.limits.effort_nm, slow_rad_s=slow, change_rad_s=change, step_s=step_s
        )
        self.drive = Drive(arm.limits, step_s)
        stiffness = arm.settings.stiffness_1_s2
        self._gains = np.array([stiffness, 2.0 * math.sqrt(stiffness), step_s])
        self._none, self._wanted = np.zeros(len(arm.joint_names)), np.zeros(len(arm.joint_names))
        self.effort_nm = self._none

    def reset(self, position_rad: Array, velocity_rad_s: Array) -> None:
        """Begin at ``position_rad`` with ``velocity_rad_s``, the motors giving nothing."""
        self.drive.reset(position_rad, velocity_rad_s)
        self.effort_nm = np.zeros_like(self._none)

    def follow(
        self, reference: tuple[Array, Array, Array], noise_rad: Array, state: tuple[Array, Array], t_s: float
    ) -> Array:
        """The torque (n,) toward ``reference`` (places, speeds, accelerations) from ``state``, by ArmWorld.step's law.

        Raises SimulationError, naming the joint, where it would not be finite.
        """
        drive, friction = self.drive, self.friction
        answer = kernel.computed_torque(
            *reference, noise_rad, *state, drive.state, drive.limits, friction.constants, self._gains, self._wanted,
            friction.terms,
        )  # fmt: skip
        drive.limited = bool(answer & kernel.LIMITED)
        if answer & kernel.NOT_FINITE:
            self._abort(self._wanted, "torque", "check the reference and robot.stiffness_1_s2", t_s)
        self._skeleton.setAccelerations(self._wanted)
        self._skeleton.computeInverseDynamics(False, False, False)
        torque: Array = self._skeleton.getForces()
        return torque

    def carry(self, command: JointTorque, velocity_rad_s: Array) -> Array:
        """The torque (n,) that carries weight and Coriolis beside a commanded torque, and friction's terms for it."""
        kernel.friction_terms(command.velocity_rad_s, velocity_rad_s, self.friction.constants, self.friction.terms)
        carried: Array = self._skeleton.getGravityForces() + coriolis_nm(self._skeleton, command.velocity_rad_s)
        return carried

    def act(self, torque_nm: Array, added_nm: Array, velocity_rad_s: Array, remedy: str, t_s: float) -> None:
        """Set what the motors give for the sum of both torques and the known friction; raises SimulationError."""
        self.effort_nm = np.empty_like(self._none)
        force = self.friction.forces(torque_nm, added_nm, velocity_rad_s, self._wanted, self.effort_nm)
        if force is None:
            self._abort(self.effort_nm, "torque", remedy, t_s)
        self._skeleton.setForces(force)

    def check_speed(self, velocity_rad_s: Array, t_s: float) -> None:
        """Raise SimulationError, naming the joint, where one has left the domain of the model."""
        fast = ~(np.abs(velocity_rad_s) < FAR_RAD_S)
        if fast.any():
            self._abort(np.where(fast, np.nan, 0.0), "speed", TORQUE_REMEDY, t_s)

    def per_joint(self, value: Array | float) -> Array:
        """``value`` for every joint."""
        if isinstance(value, np.ndarray):
            return value
        return np.full_like(self._none, value) if value else self._none

    def _abort(self, values: Array, what: str, remedy: str, t_s: float) -> Never:
        bad = int(np.argmin(np.isfinite(values)))
        name = self._arm.joint_names[bad]
        raise SimulationError(
            name,
            t_s,
            f"the {what} of joint '{name}' of {self._arm.settings.name} is {values[bad]} at {t_s:.3f} s; the "
            f"simulation stops: {remedy}",
        )
