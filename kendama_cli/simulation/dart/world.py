"""The arm with its tool, the ball on its rope and the bodies of a scene in one DART world, under a controller."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.cup import frame_along
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.robot_model.joint_torque import JointTorque, TaskState
from kendama_cli.robot_model.model import HANDLE_RADIUS_M, RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings, GameSettings
from kendama_cli.settings.interact import InteractSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.settings.scene import SceneSettings
from kendama_cli.simulation.dart.arm_errors import WRIST_JOINTS, WorldErrors
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.dynamics_kernel import ROTOR, ArmDynamics
from kendama_cli.simulation.dart.joint_control import JointControl
from kendama_cli.simulation.dart.scene import Scene, check_clear
from kendama_cli.simulation.dart.stepper import STEP_S, Stepper, WorldPair
from kendama_cli.simulation.dart.wrist import ContactSensor, task_state, wrist_wrench

SHORTEST_M = 1e-3
"""A link whose joints' origins coincide has no capsule of its own: its neighbours' caps cover it."""


class Rotors:
    """Rotors (n,) of the joints of ``body``, which its links carry, each about its joint's axis (see carry_rotors)."""

    def __init__(self, body: Body, rotor_inertia_kg_m2: Array) -> None:
        self._joints, self._nominal, self._scale = body.joints, rotor_inertia_kg_m2, 0.0
        self._moments = [np.array(one.getChildBodyNode().getInertia().getMoment()) for one in body.joints]
        self.scale_wrist(1.0)

    def scale_wrist(self, scale: float) -> Array:
        """Multiply those of the last WRIST_JOINTS joints by ``scale``, and return all."""
        rotors = np.array(self._nominal)
        rotors[-WRIST_JOINTS:] *= scale
        if scale != self._scale:
            self._scale = scale
            self._attach(rotors)
        return rotors

    def _attach(self, rotor_inertia_kg_m2: Array) -> None:
        for joint, bare, rotor in zip(self._joints, self._moments, rotor_inertia_kg_m2, strict=True):
            link = joint.getChildBodyNode()
            own = link.getInertia()
            axis = joint.getTransformFromChildBodyNode().rotation() @ np.array(joint.getAxis())
            moment = bare + rotor * np.outer(axis, axis)
            link.setInertia(dartpy.dynamics.Inertia(own.getMass(), own.getLocalCOM(), moment))


def attach_links(body: Body, arm: RobotModel, cup: CupSettings) -> None:
    """Give every link a capsule of ``robot.link_radius_m`` from its joint's origin to the next one's, and the handle.

    The handle ends at the cup's wall. Parts of the arm do not touch each other.
    """
    body.skeleton.setPositions(arm.home_rad)
    positions = arm.joint_positions_m(arm.home_rad)
    links = [joint.getChildBodyNode() for joint in body.joints]
    for link, radius, (start, end) in zip(links, arm.link_radius_m, pairwise(positions), strict=True):
        _attach_capsule(link, start, end, float(radius))
    handle = arm.tool_position_m(arm.home_rad) - positions[-1]
    length = float(np.linalg.norm(handle))
    short = max(length - cup.radius_m - cup.wall_m - HANDLE_RADIUS_M, 0.0)
    if length > SHORTEST_M:
        _attach_capsule(body.tip, positions[-1], positions[-1] + handle * (short / length), HANDLE_RADIUS_M)


def _attach_capsule(link: Any, start_m: Array, end_m: Array, radius_m: float) -> None:
    """Attach a capsule between two points of the world to ``link`` at its present pose."""
    path = end_m - start_m
    length = float(np.linalg.norm(path))
    if length < SHORTEST_M:
        return
    pose = dartpy.math.Isometry3()
    pose.set_rotation(frame_along(path / length))
    pose.set_translation((start_m + end_m) / 2)
    node = link.createShapeNode(dartpy.dynamics.CapsuleShape(radius_m, length))
    node.createCollisionAspect()
    node.createDynamicsAspect()
    node.setRelativeTransform(link.getWorldTransform().inverse().multiply(pose))


__all__ = ["NO_SCENE", "STEP_S", "ArmWorld"]

NO_SCENE = SceneSettings(bodies=())


class ArmWorld:
    """One world, advanced by ``step`` or ``step_torque``; what it holds is read from attributes after every step.

    The arm obeys q'' = H^-1 (tau - C q' - xi - g - J^T F) (eq. 2). For a game its tool is the cup, from which
    ``ball`` hangs; for an interaction its tool is the probe, whose contacts ``sensor`` feels. ``position_rad``,
    ``velocity_rad_s`` and ``effort_nm`` are (n,). Raises ConfigError, naming the body, where one of the ``scene``
    holds the arm's base or the probe at home.
    """

    def __init__(
        self,
        robot: RobotSettings,
        task: GameSettings | InteractSettings,
        scene: SceneSettings = NO_SCENE,
        *,
        links: bool = False,
    ) -> None:
        """Build the world; with ``links`` the ball touches the arm's links and the handle as well as the cup."""
        game = task if isinstance(task, GameSettings) else None
        self.arm = arm = RobotModel(
            robot, task.probe if isinstance(task, InteractSettings) else task.cup, task.gravity_m_s2
        )
        self.body = arm.new_body()
        self._rotors = Rotors(self.body, arm.rotor_inertia_kg_m2)
        if game is not None and links:
            attach_links(self.body, arm, game.cup)
        self._skeleton = self.body.skeleton
        self._dynamics = ArmDynamics(arm, game, links=links)
        self._control = JointControl(arm, self.body, self._dynamics, STEP_S)
        self._ball = TetheredBall(game, self.body) if game is not None else None
        self._sensor = None if isinstance(task, GameSettings) else _sensor(task, arm, self.body, scene)
        pair = WorldPair(task.gravity_m_s2, exact_friction=game is None)
        pair.add(self._skeleton)
        if self._ball is not None:
            pair.add(self._ball.skeleton)
        self.scene = Scene(pair.touching, scene)
        self._stepper = Stepper(pair, self._control, self.scene, self._ball, self._sensor)
        self._start_m = (0.0, 0.0)
        self.reset(arm.home_rad)

    def perturb(self, errors: WorldErrors) -> None:
        """Take on these errors from the next ``reset`` on; those of ball and rope need a game."""
        self._control.friction.set_unknown(errors.joint_friction_nm, errors.joint_friction_fraction)
        if self._ball is not None:
            self._ball.perturb(errors)
        self._start_m = (errors.ball_start_m, errors.ball_start_y_m)
        self._dynamics.links[:, ROTOR] = self._rotors.scale_wrist(errors.wrist_rotor_scale)

    def reset(self, position_rad: Array, velocity_rad_s: Array | None = None) -> None:
        """Put the arm in ``position_rad`` (n,), with ``velocity_rad_s`` (n,) or at rest, the clock at 0.

        The ball hangs still, the scene is as it began, and nothing of the time before is left in DART.
        """
        self._stepper.reset()
        velocity = np.zeros_like(self.arm.home_rad) if velocity_rad_s is None else velocity_rad_s
        self.body.put(position_rad, velocity)
        self._control.reset(position_rad, velocity)
        self._steps = 0
        self.t_s = 0.0
        if self._ball is not None:
            self._ball.hang(*self._start_m)
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
        state = self.position_rad, self.velocity_rad_s
        reference = position_rad, velocity_rad_s, acceleration_rad_s2
        self._stepper.follow(reference, noise_rad, feedforward_nm, state, self.t_s)
        self._advanced()

    def step_torque(self, command: JointTorque) -> None:
        """Advance by STEP_S under the commanded torque, with weight, Coriolis and the known friction compensated.

        Raises SimulationError, naming the joint, where the torque or the motion is not finite.
        """
        self._stepper.give(command, (self.position_rad, self.velocity_rad_s), self.t_s)
        self._advanced()
        self._control.check_speed(self.velocity_rad_s, self.t_s)

    def _advanced(self) -> None:
        """Read what a step of DART has made."""
        self._steps += 1
        self.t_s = self._steps * STEP_S
        self._observe()

    def state(self) -> TaskState:
        """Return the state of the arm and its contact for a task-space controller with the probe."""
        return task_state(self.arm, self.position_rad, self.velocity_rad_s, self.sensor.felt_n)

    def wrist_wrench(self) -> Array:
        """Return the wrench between tip link and tool after the last step: (6,), force [N], torque [Nm]."""
        if self._ball is not None:
            self._ball.react()
        return wrist_wrench(self.body, self._stepper.world)

    @property
    def limited(self) -> bool:
        """Return True if the drive had to change the last reference to keep to the joints' limits."""
        return self._control.drive.limited

    @property
    def effort_nm(self) -> Array:
        """Motors' torques in the last step (n,)."""
        return self._control.effort_nm

    @property
    def tool_m(self) -> Array:
        """Return the position in the world (3,) of the tool's tie point, or of the probe's centre."""
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
        """Sensor of the probe's contacts; there is none beside a cup."""
        assert self._sensor is not None
        return self._sensor

    def _observe(self) -> None:
        self.position_rad: Array = self._skeleton.getPositions()
        self.velocity_rad_s: Array = self._skeleton.getVelocities()
        if self._ball is not None:
            self._ball.observe()


def _sensor(task: InteractSettings, arm: RobotModel, body: Body, scene: SceneSettings) -> ContactSensor:
    base_m = np.linspace(arm.settings.base_position_m, arm.joint_positions_m(arm.home_rad)[0], num=50)
    check_clear(scene, base_m, arm.tool_position_m(arm.home_rad), task.probe.radius_m)
    return ContactSensor(body.cup, task.probe.mass_kg, task.sensor_hz, STEP_S)
