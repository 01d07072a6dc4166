"""The arm with its tool, the ball on its rope and the bodies of a scene in one DART world, under a controller."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Never

import numpy as np

from kendama_cli.errors import SimulationError
from kendama_cli.motion.impedance import JointTorque, TaskState
from kendama_cli.motion.task_settings import InteractSettings
from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.dart_library import awake_world, dartpy
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.scene import SceneSettings
from kendama_cli.simulation.dart import joint_kernel as kernel
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.drive import Drive
from kendama_cli.simulation.dart.joint_friction import JointFriction
from kendama_cli.simulation.dart.scene import Scene, check_clear
from kendama_cli.simulation.dart.task_state import coriolis_nm, task_state
from kendama_cli.simulation.dart.wrist import ContactSensor, wrist_wrench

STEP_S = 0.001
"""Step of simulation and control: at 1 ms nothing tunnels up to 8 m/s and the rope is far from its stability limit."""
MAY_STOP_STEPS = 2.0
"""A joint that its acceleration limit could stop within this many steps is left to DART's friction constraint."""
FAR_RAD_S = 1e4
"""A joint faster than this has left the domain of the model."""
NO_SCENE = SceneSettings(bodies=())


@dataclass(frozen=True)
class WorldErrors:
    """How one world differs from what its controller believes (see settings.robot.Imperfection).

    ``joint_friction_nm`` is Coulomb friction of every joint beyond the known one, ``joint_friction_share`` the share of
    each joint's known friction that comes on top of it; ``restitution`` that of ball and cup, None as in the game.
    """

    rope_scale: float = 1.0
    ball_start_m: float = 0.0
    joint_friction_nm: float = 0.0
    joint_friction_share: float = 0.0
    restitution: float | None = None


NO_ERRORS = WorldErrors()


class ArmWorld:
    """One world, advanced by ``step`` or ``step_torque``; what it holds is read from attributes after every step.

    The arm obeys q'' = H^-1 (tau - C q' - xi - g - J^T F) (PAPER.md eq. 2). For a game its tool is the cup, from which
    ``ball`` hangs; for an interaction its tool is the probe, whose contacts ``sensor`` feels. ``position_rad``,
    ``velocity_rad_s`` and ``effort_nm`` are (n,).

    Raises ConfigError, naming the body, where one of the ``scene`` holds the arm's base or the probe at home.
    """

    def __init__(
        self, robot: RobotSettings, task: GameSettings | InteractSettings, scene: SceneSettings = NO_SCENE
    ) -> None:
        game = task if isinstance(task, GameSettings) else None
        self.arm = arm = RobotModel(
            robot, task.probe if isinstance(task, InteractSettings) else task.cup, task.gravity_m_s2
        )
        self.body = arm.new_body()
        self._skeleton = self.body.skeleton
        self._exact_friction = game is None
        self._world = _new_world(task.gravity_m_s2, exact_friction=game is None)
        self._world.addSkeleton(self._skeleton)
        self._ball = TetheredBall(game, self.body) if game is not None else None
        if self._ball is not None:
            self._world.addSkeleton(self._ball.skeleton)
        self._sensor: ContactSensor | None = None
        if isinstance(task, InteractSettings):
            self._sensor = ContactSensor(self.body.cup, task.probe.mass_kg, task.sensor_hz, STEP_S)
            base_m = np.linspace(robot.base_position_m, arm.joint_places_m(arm.home_rad)[0], num=50)
            check_clear(scene, base_m, arm.tool_place_m(arm.home_rad), task.probe.radius_m)
        self.scene = Scene(self._world, scene)
        self._friction = _friction(arm, self.body, always_held=game is None)
        self._drive = Drive(arm.limits, STEP_S)
        kp = robot.stiffness_1_s2
        self._gains = np.array([kp, 2.0 * math.sqrt(kp), STEP_S, 1.0 / STEP_S])
        self._none, self._wanted = np.zeros(len(arm.joint_names)), np.zeros(len(arm.joint_names))
        self._start_m = 0.0
        self.reset(arm.home_rad)

    def perturb(self, errors: WorldErrors) -> None:
        """Take on these errors from the next ``reset`` on; those of ball and rope need a game."""
        self._friction.set_unknown(errors.joint_friction_nm, errors.joint_friction_share)
        if self._ball is not None:
            self._ball.perturb(errors.rope_scale, errors.restitution)
        self._start_m = errors.ball_start_m

    def reset(self, position_rad: Array, velocity_rad_s: Array | None = None) -> None:
        """The arm in ``position_rad`` (n,), at rest where no ``velocity_rad_s`` (n,) is given, the clock at 0.

        The ball hangs still, the scene is as it began, and nothing of the time before is left in DART.
        """
        self._renew()
        velocity = self._none if velocity_rad_s is None else velocity_rad_s
        self._skeleton.resetAccelerations()
        self._skeleton.resetGeneralizedForces()
        self._skeleton.setPositions(position_rad)
        self._skeleton.setVelocities(velocity)
        self._skeleton.clearExternalForces()
        self.scene.reset()
        self._drive.reset(position_rad, velocity)
        self._steps = 0
        self.t_s = 0.0
        self.effort_nm: Array = np.zeros(len(self._none))
        if self._ball is not None:
            self._ball.hang(self._start_m)
        if self._sensor is not None:
            self._sensor.reset()
        self._observe()

    def step(
        self,
        position_rad: Array,
        velocity_rad_s: Array,
        acceleration_rad_s2: Array,
        noise_rad: Array | float = 0.0,
        feedforward_nm: Array | float = 0.0,
    ) -> None:
        """Advance by STEP_S toward the reference (n,) for this instant, after the drive has held it to the limits.

            tau = H (q_ref'' + Kd (q_ref' - q') + Kp (q_ref - q)) + C q' + g + xi,   Kd = 2 sqrt Kp

        with the errors of this instant and the mean acceleration that takes the reference to the next one.
        ``noise_rad`` is added to the angles read, ``feedforward_nm`` to the torque commanded; the motors clip the sum
        to their limits. Raises SimulationError, naming the joint, where a torque would not be finite.
        """
        skeleton, drive, friction, wanted = self._skeleton, self._drive, self._friction, self._wanted
        answer = kernel.computed_torque(
            position_rad,
            velocity_rad_s,
            acceleration_rad_s2,
            self._per_joint(noise_rad),
            self.position_rad,
            self.velocity_rad_s,
            drive.state,
            drive.limits,
            friction.constants,
            self._gains,
            wanted,
            friction.terms,
        )
        drive.limited = bool(answer & kernel.LIMITED)
        if answer & kernel.NOT_FINITE:
            self._abort(wanted, "torque", "check the reference and robot.stiffness_1_s2")
        skeleton.setAccelerations(wanted)
        skeleton.computeInverseDynamics(False, False, False)
        self._advance(skeleton.getForces(), self._per_joint(feedforward_nm), "check the reference and its feedforward")

    def step_torque(self, command: JointTorque) -> None:
        """Advance by STEP_S under the commanded torque, with weight, Coriolis and the known friction compensated.

        Raises SimulationError, naming the joint, where the torque or the motion is not finite.
        """
        friction, remedy = self._friction, "lower interact.controller.stiffness_n_m, or check the script"
        kernel.friction_terms(command.velocity_rad_s, self.velocity_rad_s, friction.constants, friction.terms)
        carried = self._skeleton.getGravityForces() + coriolis_nm(self._skeleton, command.velocity_rad_s)
        self._advance(command.torque_nm, carried, remedy)
        fast = ~(np.abs(self.velocity_rad_s) < FAR_RAD_S)
        if fast.any():
            self._abort(np.where(fast, np.nan, 0.0), "speed", remedy)

    def _advance(self, torque_nm: Array, added_nm: Array, remedy: str) -> None:
        """One step of DART under what the motors give for the sum of both torques (n,) and the known friction."""
        self.effort_nm = np.empty_like(self._none)
        force = self._friction.forces(torque_nm, added_nm, self.velocity_rad_s, self._wanted, self.effort_nm)
        if force is None:
            self._abort(self.effort_nm, "torque", remedy)
        self._skeleton.setForces(force)
        if self._ball is not None:
            self._ball.pull(self.t_s)
        self.scene.pull()
        self._world.step()
        self._steps += 1
        self.t_s = self._steps * STEP_S
        self._observe()
        if self._sensor is not None:
            self._sensor.read(self._world)

    def state(self) -> TaskState:
        """What a task-space controller with the probe knows of the arm and its contact."""
        return task_state(self.body, self.sensor.felt_n)

    def wrist_wrench(self) -> Array:
        """What a sensor between the tip link and the tool feels after the last step: (6,), force [N], torque [Nm]."""
        if self._ball is not None:
            self._ball.react()
        return wrist_wrench(self.body, self._world)

    @property
    def limited(self) -> bool:
        """Whether the drive had to change the last reference to keep to the joints' limits."""
        return self._drive.limited

    @property
    def tool_m(self) -> Array:
        """Where the tool's tie point, or the probe's centre, is in the world (3,)."""
        return np.array(self.body.tie.getCOM())

    @property
    def tool_rotation(self) -> Array:
        """The rotation (3, 3) from the tool to the world."""
        return np.array(self.body.cup.getWorldTransform().rotation())

    @property
    def ball(self) -> TetheredBall:
        """The ball of the game; there is none beside a probe."""
        assert self._ball is not None
        return self._ball

    @property
    def sensor(self) -> ContactSensor:
        """What feels the probe's contacts; there is none beside a cup."""
        assert self._sensor is not None
        return self._sensor

    def _per_joint(self, value: Array | float) -> Array:
        if isinstance(value, np.ndarray):
            return value
        return np.full_like(self._none, value) if value else self._none

    def _observe(self) -> None:
        self.position_rad: Array = self._skeleton.getPositions()
        self.velocity_rad_s: Array = self._skeleton.getVelocities()
        if self._ball is not None:
            self._ball.observe()

    def _renew(self) -> None:
        """Move everything into a new world of DART, whose solver would start from what it found before."""
        old = self._world
        skeletons = [old.getSkeleton(number) for number in range(old.getNumSkeletons())]
        old.removeAllSkeletons()
        self._world = _new_world(self.arm.gravity_m_s2, exact_friction=self._exact_friction)
        for skeleton in skeletons:
            self._world.addSkeleton(skeleton)

    def _abort(self, values: Array, what: str, remedy: str) -> Never:
        bad = int(np.argmin(np.isfinite(values)))
        name = self.arm.joint_names[bad]
        raise SimulationError(
            name,
            self.t_s,
            f"the {what} of joint '{name}' of {self.arm.settings.name} is {values[bad]} at {self.t_s:.3f} s; the "
            f"simulation stops: {remedy}",
        )


def _new_world(gravity_m_s2: float, *, exact_friction: bool) -> Any:
    world = awake_world(STEP_S, gravity_m_s2)
    if exact_friction:
        # DART's default bounds friction by the normal force that would act without it: on an arm, whose directions
        # are coupled, that was wrong by a quarter; this one iterates until Coulomb's law holds
        world.getConstraintSolver().setBoxedLcpSolver(dartpy.constraint.NsgsFrictionSolver())
    return world


def _friction(arm: RobotModel, body: Body, *, always_held: bool) -> JointFriction:
    """The joints' friction; in contact any joint may stop within a step, so that all are ``always_held``."""
    slow, change = MAY_STOP_STEPS * STEP_S * arm.limits.acceleration_rad_s2, STEP_S * arm.mobility(arm.home_rad)
    if always_held:
        slow, change = np.full_like(slow, np.inf), np.zeros_like(slow)
    return JointFriction(
        body.joints, arm.friction, arm.limits.effort_nm, slow_rad_s=slow, change_rad_s=change, step_s=STEP_S
    )
