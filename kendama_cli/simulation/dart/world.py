"""The arm with the cup and the ball on its rope in one DART world, under a controller."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from kendama_cli.robot_model.arm_motion import SAMPLE_S
from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.cup import frame_along
from kendama_cli.robot_model.dart_library import awake_world, dartpy
from kendama_cli.robot_model.model import HANDLE_RADIUS_M, RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings, GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.arm_errors import WRIST_JOINTS, WorldErrors
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.dynamics_kernel import ROTOR, ArmArrays
from kendama_cli.simulation.dart.joint_control import JointControl
from kendama_cli.simulation.dart.wrist import wrist_wrench

STEP_S = SAMPLE_S
"""Step of simulation and control, one sample of a planned motion.

At 1 ms nothing tunnels up to 8 m/s and the rope is far from its stability limit.
"""
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


__all__ = ["STEP_S", "ArmWorld"]


class ArmWorld:
    """One world, advanced by ``step``; what it holds is read from attributes after every step.

    The arm obeys q'' = H^-1 (tau - C q' - xi - g - J^T F) (eq. 2); from its cup hangs the ``ball``. ``position_rad``,
    ``velocity_rad_s`` and ``effort_nm`` are (n,).

    Compiled code makes each step in which nothing can touch and no joint comes to its limits (step_kernel), DART the
    others: it takes the state over where it is needed.
    """

    position_rad: Array
    velocity_rad_s: Array

    def __init__(self, robot: RobotSettings, game: GameSettings, *, links: bool = False) -> None:
        """Build the world; with ``links`` the ball touches the arm's links and the handle as well as the cup."""
        self.arm = arm = RobotModel(robot, game.cup, game.gravity_m_s2)
        self._body = body = arm.new_body()
        self._rotors = Rotors(body, arm.rotor_inertia_kg_m2)
        if links:
            attach_links(body, arm, game.cup)
        self._skeleton = body.skeleton
        self._arrays = ArmArrays(arm, game, links=links)
        self._control = JointControl(arm, body, self._arrays, STEP_S)
        self.ball = TetheredBall(game, body, self._arrays)
        self._start_m = (0.0, 0.0)
        self.reset(arm.home_rad)

    def perturb(self, errors: WorldErrors) -> None:
        """Take on these errors from the next ``reset`` on."""
        self._control.friction.set_unknown(errors.joint_friction_nm, errors.joint_friction_fraction)
        self.ball.perturb(errors)
        self._start_m = (errors.ball_start_m, errors.ball_start_y_m)
        self._arrays.links[:, ROTOR] = self._rotors.scale_wrist(errors.wrist_rotor_scale)

    def reset(self, position_rad: Array, velocity_rad_s: Array | None = None) -> None:
        """Put the arm in ``position_rad`` (n,), with ``velocity_rad_s`` (n,) or at rest, the clock at 0.

        The ball hangs still, and nothing of the time before is left in DART.
        """
        velocity = np.zeros_like(self.arm.home_rad) if velocity_rad_s is None else velocity_rad_s
        self._dart = awake_world(STEP_S, self.ball.game.gravity_m_s2)  # a solver would start from what it found before
        for skeleton in (self._skeleton, self.ball.skeleton):
            self._dart.addSkeleton(skeleton)
        self._body.put(position_rad, velocity)
        self._control.reset(position_rad, velocity)
        self._control.take(self.ball)
        self._steps, self.t_s = 0, 0.0
        self._after: Array | None = None
        self._read()
        self.ball.hang(*self._start_m)

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
        ball, control = self.ball, self._control
        after = control.follow(ball, reference, noise_rad, feedforward_nm, state, self.t_s)
        if after is None:
            self._hand_over()
            ball.skeleton.setForces(ball.force_n)
            self._skeleton.setForces(control.force_nm)
            self._dart.step()
            self._read()
            ball.observe()
        else:
            n = len(control.effort_nm)
            self.position_rad, self.velocity_rad_s = after[:n], after[n : 2 * n]
            ball.position_m, ball.velocity_m_s = after[3 * n : 3 * n + 3], after[3 * n + 3 :]
        self._after = after
        self._steps += 1
        self.t_s = self._steps * STEP_S

    def wrist_wrench(self) -> Array:
        """Return the wrench between tip link and tool after the last step: (6,), force [N], torque [Nm]."""
        contacts = self._dart.getLastCollisionResult().getContacts() if self._after is None else ()
        body = self.body
        self.ball.react()
        return wrist_wrench(body, contacts)

    @property
    def body(self) -> Body:
        """DART's bodies of the arm in the present state."""
        self._hand_over()
        return self._body

    @property
    def limited(self) -> bool:
        """Return True if the drive had to change the last reference to keep to the joints' limits."""
        return self._control.drive.limited

    @property
    def effort_nm(self) -> Array:
        """Motors' torques in the last step (n,)."""
        return self._control.effort_nm

    def _hand_over(self) -> None:
        """Let DART have the state that compiled code has made."""
        if self._after is not None:
            n, ball = len(self.position_rad), self.ball
            self._skeleton.setPositions(self.position_rad)
            self._skeleton.setVelocities(self.velocity_rad_s)
            self._skeleton.setAccelerations(self._after[2 * n : 3 * n])
            ball.skeleton.setPositions(ball.position_m)
            ball.skeleton.setVelocities(ball.velocity_m_s)

    def _read(self) -> None:
        """Take the arm's state over from DART."""
        self.position_rad, self.velocity_rad_s = self._skeleton.getPositions(), self._skeleton.getVelocities()
        self._arrays.move(self.position_rad, self.velocity_rad_s)
