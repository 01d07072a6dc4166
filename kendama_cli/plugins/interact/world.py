"""The arm with its probe among the bodies of a scene in one DART world, under commanded torques."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from kendama_cli.errors import SimulationError
from kendama_cli.plugins.interact.interface import JointTorque, TaskState
from kendama_cli.plugins.interact.scene import Scene, check_clear
from kendama_cli.plugins.interact.scene_settings import SceneSettings
from kendama_cli.plugins.interact.settings import InteractSettings, ProbeSettings
from kendama_cli.robot_model.dart_library import awake_world, dartpy
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.robot import Imperfection, RobotSettings
from kendama_cli.simulation.dart import torque_kernel
from kendama_cli.simulation.dart.joint_control import JointFriction
from kendama_cli.simulation.dart.world import STEP_S, Rotors
from kendama_cli.simulation.dart.wrist import body_of, wrist_wrench

POINT_KG_M2 = 1e-9
"""Its mass is a point; DART wants an inertia that is not zero."""
FAR_RAD_S = 1e4
"""A joint faster than this has left the domain of the model."""


def attach_probe(skeleton: Any, holder: Any, place: Any, probe: ProbeSettings) -> tuple[Any, Any]:
    """Weld the probe to the body ``holder`` at ``place`` (the ball's centre); returns its body, twice (AttachTool)."""
    joint, body = skeleton.createWeldJointAndBodyNodePair(holder)
    joint.setTransformFromParentBodyNode(place)
    body.setName("probe")
    body.setInertia(dartpy.dynamics.Inertia(probe.mass_kg, np.zeros(3), np.eye(3) * POINT_KG_M2))
    node = body.createShapeNode(dartpy.dynamics.SphereShape(probe.radius_m))
    node.setName("probe")
    node.createCollisionAspect()
    surface = node.createDynamicsAspect()
    surface.setFrictionCoeff(probe.friction)
    surface.setRestitutionCoeff(probe.restitution)
    return body, body


class ProbeWorld:
    """One world, advanced by ``step``; what it holds is read from attributes after every step.

    The arm carries its own weight, Coriolis forces and known friction; DART finds friction, contacts and stops
    together. With an ``imperfection`` its joints have friction beyond that, and its encoders noise from ``rng``.
    ``state`` is what a controller reads: its contact is that of the wrist's sensor less the probe's weight,
    F = m g - R f (f being what the probe exerts on the tip link, in its frame), through a filter of first order and
    ``sensor_hz``; the probe's inertia is in. Only the world knows ``contact_n`` (3,) and the body that is ``touched``,
    "" for none. Raises ConfigError, naming the body, where one of the scene holds the arm's base or the probe at home.
    """

    def __init__(
        self,
        robot: RobotSettings,
        interact: InteractSettings,
        scene: SceneSettings,
        imperfection: Imperfection | None = None,
        rng: np.random.Generator | None = None,
    ) -> None:
        probe, gravity_m_s2 = interact.probe, interact.gravity_m_s2
        self.arm = arm = RobotModel(robot, partial(attach_probe, probe=probe), gravity_m_s2)
        self.body = body = arm.new_body()
        Rotors(body, arm.rotor_inertia_kg_m2)
        self._friction = JointFriction(body.joints, arm.friction, arm.limits.effort_nm)
        self._noise_rad, self._rng = 0.0, rng or np.random.default_rng(0)
        if imperfection is not None:
            self._friction.set_unknown(imperfection.joint_friction_nm, imperfection.joint_friction_fraction)
            self._noise_rad = imperfection.joint_noise_rad
        base_m = np.linspace(robot.base_position_m, arm.joint_positions_m(arm.home_rad)[0], num=50)
        check_clear(scene, base_m, arm.tool_position_m(arm.home_rad), probe.radius_m)
        self._world = world = awake_world(STEP_S, gravity_m_s2)
        # DART's default bounds friction by the normal force that would act without it: on an arm, whose directions are
        # coupled, that was wrong by a quarter; this one iterates until Coulomb's law holds
        world.getConstraintSolver().setBoxedLcpSolver(dartpy.constraint.NsgsFrictionSolver())
        world.addSkeleton(body.skeleton)
        self.scene = Scene(world, scene)
        self._weight_n = probe.mass_kg * np.array([0.0, 0.0, -gravity_m_s2])
        self._share = 1.0 - math.exp(-2.0 * math.pi * interact.sensor_hz * STEP_S)
        for joint in body.joints:
            joint.setLimitEnforcement(True)
        body.put(arm.home_rad, np.zeros_like(arm.home_rad))
        self.effort_nm: Array = np.zeros_like(arm.home_rad)
        self.contact_n, self.touched = np.zeros(3), ""
        self._steps, self.t_s = 0, 0.0
        self._read(np.zeros(3))

    def step(self, command: JointTorque) -> None:
        """Advance by STEP_S under the commanded torque, with what it carries, both within the motors' limits.

        Raises SimulationError, naming the joint, where the torque or the motion is not finite.
        """
        skeleton, friction = self.body.skeleton, self._friction
        model = self.arm.posed(self.position_rad, self.velocity_rad_s).skeleton
        carried: Array = model.getGravityForces() + coriolis_nm(model, command.velocity_rad_s)
        self.effort_nm = np.empty_like(self.effort_nm)
        if not torque_kernel.efforts(
            command.torque_nm, carried, self.velocity_rad_s, command.velocity_rad_s,
            friction.constants, friction.unknown, self.effort_nm, friction.level_nm,
        ):  # fmt: skip
            self._refuse("torque", self.effort_nm, np.isfinite(self.effort_nm))
        for joint, level in zip(self.body.joints, friction.level_nm.tolist(), strict=True):
            joint.setCoulombFriction(0, level)
        skeleton.setForces(self.effort_nm)
        self.scene.pull()
        self._world.step()
        self._steps += 1
        self.t_s = self._steps * STEP_S
        self._read(self.state.contact_n)
        self._refuse("velocity", self.velocity_rad_s, np.abs(self.velocity_rad_s) < FAR_RAD_S)

    def _read(self, felt_n: Array) -> None:
        """Read what a step has made; ``felt_n`` (3,) is what the sensor read before it."""
        skeleton, arm = self.body.skeleton, self.arm
        self.position_rad, self.velocity_rad_s = skeleton.getPositions(), skeleton.getVelocities()
        self.wrench = wrist_wrench(self.body, self._world.getLastCollisionResult().getContacts())
        angles = self.position_rad
        if self._noise_rad > 0:
            angles = angles + self._rng.normal(0.0, self._noise_rad, len(angles))
        if self._steps:
            rotation = np.array(arm.posed(angles).tip.getWorldTransform().rotation())
            felt_n = felt_n + self._share * (self._weight_n - rotation @ self.wrench[:3] - felt_n)
            self._touch()
        self.state = _task_state(arm, angles, self.velocity_rad_s, felt_n)

    def _touch(self) -> None:
        """Gather what the tool exerted in the last step."""
        tool = self.body.cup
        self.contact_n, self.touched = np.zeros(3), ""
        for contact in self._world.getLastCollisionResult().getContacts():
            first, second = contact.collisionObject1, contact.collisionObject2
            # DART's force acts on the first of the two
            if body_of(first) == tool:
                self.contact_n, self.touched = self.contact_n - contact.force, _name(second)
            elif body_of(second) == tool:
                self.contact_n, self.touched = self.contact_n + contact.force, _name(first)

    def _refuse(self, what: str, values: Array, fine: Array) -> None:
        """Raise SimulationError, naming the joint, where a value is not ``fine``."""
        if fine.all():
            return
        name = self.arm.joint_names[bad := int(np.argmin(fine))]
        raise SimulationError(
            name,
            self.t_s,
            f"the {what} of joint '{name}' of {self.arm.settings.name} is {values[bad]} at {self.t_s:.3f} s; the "
            "simulation stops: lower interact.controller.stiffness_n_m, or check the script",
        )


def _name(touching: Any) -> str:
    return str(touching.getShapeFrame().getName()).removeprefix("scene ")


def _task_state(arm: RobotModel, position_rad: Array, velocity_rad_s: Array, felt_n: Array) -> TaskState:
    """Return the arm in that state (n,), with ``felt_n`` (3,), the contact's force as the wrist's sensor reads it."""
    body = arm.posed(position_rad, velocity_rad_s)
    tool, skeleton = body.cup, body.skeleton
    jacobian, rate = skeleton.getWorldJacobian(tool), skeleton.getJacobianClassicDeriv(tool)
    pose = tool.getWorldTransform()
    return TaskState(
        position_rad=position_rad,
        velocity_rad_s=velocity_rad_s,
        tool_m=np.array(pose.translation()),
        tool_rotation=np.array(pose.rotation()),
        jacobian=np.vstack([jacobian[3:], jacobian[:3]]),
        jacobian_rate=np.vstack([rate[3:], rate[:3]]),
        inertia=skeleton.getMassMatrix() + np.diag(arm.rotor_inertia_kg_m2),
        contact_n=felt_n,
    )


def coriolis_nm(skeleton: Any, velocity_rad_s: Array) -> Array:
    """Return C(q, q') v (n,) for any v = ``velocity_rad_s``, C being that of Christoffel's symbols.

    C(q, a) b is symmetric in a and b, and C(q, a) a is what DART knows: C(q, a) b is a quarter of its difference
    at a + b and a - b.
    """
    now = skeleton.getVelocities()
    skeleton.setVelocities(now + velocity_rad_s)
    plus = skeleton.getCoriolisForces()
    skeleton.setVelocities(now - velocity_rad_s)
    minus = skeleton.getCoriolisForces()
    skeleton.setVelocities(now)
    return np.asarray((plus - minus) / 4)
