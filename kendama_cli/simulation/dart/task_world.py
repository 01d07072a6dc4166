"""An arm with a probe in a scene, controlled by joint torques: no ball, no rope, no game."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.errors import SimulationError
from kendama_cli.motion.impedance import JointTorque, TaskState
from kendama_cli.motion.task_settings import InteractSettings
from kendama_cli.robot_model.dart_library import awake_world, dartpy
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.scene import SceneSettings
from kendama_cli.simulation.dart.joint_friction import JointFriction
from kendama_cli.simulation.dart.scene import Scene, check_clear

STEP_S = 0.001
"""Step of simulation and control."""

FAR_RAD_S = 1e4
"""A joint faster than this has left the domain of the model."""


class TaskWorld:
    """One world, stepped by ``step``; the state is in plain attributes after every step.

    ``contact_n`` (3,) is what the probe exerts on other bodies, in the world, ``felt_n`` what the sensor at the wrist
    tells of it: it sits before the probe, whose weight is taken off, whose inertia is not, and it is of first order.

    Raises ConfigError, naming the body, where one holds the arm's base or its tool at home.
    """

    def __init__(self, robot: RobotSettings, interact: InteractSettings, scene: SceneSettings) -> None:
        probe = interact.probe
        self.arm = arm = RobotModel(robot, probe, interact.gravity_m_s2)
        self.body = arm.new_body()
        self.probe = self.body.cup
        self._mass_kg = probe.mass_kg
        self._gravity = np.array([0.0, 0.0, -interact.gravity_m_s2])
        self._sensor_share = 1.0 - math.exp(-2.0 * math.pi * interact.sensor_hz * STEP_S)
        self._skeleton = self.body.skeleton
        self._skeleton.setPositions(arm.home_rad)
        foot = self._skeleton.getRootBodyNode().getWorldTransform().translation()
        first = self.body.joints[0].getChildBodyNode().getWorldTransform().translation()
        base_m = np.linspace(foot, first, num=50)
        check_clear(scene, base_m, np.array(self.probe.getWorldTransform().translation()), probe.radius_m)
        self._world = awake_world(STEP_S, interact.gravity_m_s2)
        # DART's default bounds friction by the normal force that would act without it: on an arm, whose directions are
        # coupled, that was wrong by a quarter; this one iterates until Coulomb's law holds
        self._world.getConstraintSolver().setBoxedLcpSolver(dartpy.constraint.NsgsFrictionSolver())
        self._world.addSkeleton(self._skeleton)
        self.scene = Scene(self._world, scene)
        # in contact any joint may stop within a step: DART's constraint holds the friction of all of them
        always = np.full(len(arm.joint_names), np.inf)
        self._friction = JointFriction(
            self.body.joints, arm.friction, slow_rad_s=always, change_rad_s=np.zeros_like(always)
        )
        self._ones = np.ones(len(arm.joint_names))
        self._steps = 0
        self.t_s = 0.0
        self.effort_nm = np.zeros(len(self._ones))
        self.contact_n = np.zeros(3)
        self.contact_nm = np.zeros(3)
        self.felt_n = np.zeros(3)
        self.touched = ""
        self._observe()

    def step(self, command: JointTorque) -> None:
        """Advance by STEP_S under the commanded torque, with weight, Coriolis and the known friction compensated.

        Raises SimulationError, naming the joint, where the torque or the motion is not finite.
        """
        torque = command.torque_nm + self._friction.compensation(command.velocity_rad_s, self.velocity_rad_s)
        torque += self._skeleton.getGravityForces() + self.coriolis_nm(command.velocity_rad_s)
        if not math.isfinite(torque.dot(self._ones)):
            self._abort(torque, "torque", "Nm")
        self._skeleton.setCommands(torque)  # clips to the effort limits, setForces would not
        self.effort_nm = self._skeleton.getCommands()
        self._friction.torque(self.velocity_rad_s)  # 0 for all joints: it sets the constraint's level
        self.scene.pull()
        self._world.step()
        self._steps += 1
        self.t_s = self._steps * STEP_S
        self._observe()
        self._feel()
        if not float(np.abs(self.velocity_rad_s).sum()) < FAR_RAD_S:
            self._abort(np.where(np.abs(self.velocity_rad_s) < FAR_RAD_S, 0.0, np.nan), "speed", "rad/s")

    def state(self) -> TaskState:
        """What a task-space controller is told: the arm as it is, and the contact as the wrist's sensor feels it."""
        probe, skeleton = self.probe, self._skeleton
        jacobian = skeleton.getWorldJacobian(probe)
        rate = skeleton.getJacobianClassicDeriv(probe)
        return TaskState(
            position_rad=self.position_rad,
            velocity_rad_s=self.velocity_rad_s,
            tool_m=self.tool_m,
            tool_rotation=self.tool_rotation,
            jacobian=np.vstack([jacobian[3:], jacobian[:3]]),
            jacobian_rate=np.vstack([rate[3:], rate[:3]]),
            inertia=skeleton.getMassMatrix(),
            contact_n=self.felt_n,
        )

    def wrist_wrench(self) -> Array:
        """What a sensor between tip link and probe feels after the last step: (6,), force [N], then torque [Nm].

        It is what the probe exerts on the tip link, in that link's frame at its origin.
        """
        place = self.body.tip.getWorldTransform()
        lever = self.tool_m - place.translation()
        inertial = self._mass_kg * (self._gravity - self.probe.getCOMLinearAcceleration())
        force = inertial - self.contact_n
        torque = np.cross(lever, force) - self.contact_nm
        return np.concatenate([place.rotation().T @ force, place.rotation().T @ torque])

    def coriolis_nm(self, velocity_rad_s: Array) -> Array:
        """C(q, q') v (n,) for any v = ``velocity_rad_s``, C being that of Christoffel's symbols.

        C(q, a) b is symmetric in a and b, and C(q, a) a is what DART knows: C(q, a) b is a quarter of its difference
        at a + b and a - b.
        """
        skeleton, now = self._skeleton, self.velocity_rad_s
        skeleton.setVelocities(now + velocity_rad_s)
        plus = skeleton.getCoriolisForces()
        skeleton.setVelocities(now - velocity_rad_s)
        minus = skeleton.getCoriolisForces()
        skeleton.setVelocities(now)
        return np.asarray((plus - minus) / 4)

    def energy_j(self) -> float:
        """Kinetic energy of the arm [J]."""
        return float(self._skeleton.computeKineticEnergy())

    def push(self, force_n: Array) -> None:
        """Let an outside force (3,) [N], in the world, act on the probe's centre during the coming step."""
        self.probe.addExtForce(force_n)

    def _observe(self) -> None:
        self.position_rad: Array = self._skeleton.getPositions()
        self.velocity_rad_s: Array = self._skeleton.getVelocities()
        place = self.probe.getWorldTransform()
        self.tool_m: Array = np.array(place.translation())
        self.tool_rotation: Array = np.array(place.rotation())

    def _feel(self) -> None:
        """Gather what the probe exerted on other bodies in the last step: force, torque about its centre, whom."""
        force, torque, touched = np.zeros(3), np.zeros(3), ""
        for contact in self._world.getLastCollisionResult().getContacts():
            names = [one.getShapeFrame().getName() for one in (contact.collisionObject1, contact.collisionObject2)]
            if "probe" not in names:
                continue
            # the force told acts on the first of the two
            exerted = -contact.force if names[0] == "probe" else contact.force
            force += exerted
            torque += np.cross(contact.point - self.tool_m, exerted)
            touched = names[1 - names.index("probe")].removeprefix("scene ")
        self.contact_n, self.contact_nm, self.touched = force, torque, touched
        reading = force + self._mass_kg * self.probe.getCOMLinearAcceleration()
        self.felt_n = self.felt_n + self._sensor_share * (reading - self.felt_n)

    def _abort(self, values: Array, what: str, unit: str) -> None:
        bad = int(np.argmin(np.isfinite(values)))
        name = self.arm.joint_names[bad]
        raise SimulationError(
            name,
            self.t_s,
            f"the {what} of joint '{name}' of {self.arm.settings.name} is {values[bad]} {unit} at {self.t_s:.3f} s; "
            "the simulation stops: lower interact.controller.stiffness_n_m, or check the script",
        )
