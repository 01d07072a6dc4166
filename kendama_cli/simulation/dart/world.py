"""The arm, the cup, the ball and the rope in one DART world, in the closed loop of the arm's controller."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.errors import SimulationError
from kendama_cli.robot_model.cup import set_restitution
from kendama_cli.robot_model.dart_library import awake_world
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.ball import make_ball
from kendama_cli.simulation.dart.drive import Drive
from kendama_cli.simulation.dart.joint_friction import JointFriction
from kendama_cli.simulation.dart.rope import rope_force

STEP_S = 0.001
"""Step of simulation and control: at 1 ms nothing tunnels up to 8 m/s and the rope is far from its stability limit."""
MAY_STOP_STEPS = 2.0
"""A joint that its acceleration limit could stop within this many steps is left to DART's friction constraint."""

FAR = 1e4
"""A ball farther away or faster than this, in m and m/s, has left the domain of the model."""


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
    """One world, stepped by ``step``; the state is in plain attributes after every step.

    The arm obeys q'' = H^-1 (tau - C q' - xi - g - J^T F) (PAPER.md eq. 2), the ball m z'' = f_r + f_a + m g (eq. 1),
    with the rope's reaction on the cup. The controller is computed torque:

        tau = H (q_ref'' + Kd (q_ref' - q') + Kp (q_ref - q)) + C q' + g + xi,   Kd = 2 sqrt Kp

    with the errors of this instant and the mean acceleration that takes the reference to the next one.
    """

    def __init__(self, robot: RobotSettings, game: GameSettings) -> None:
        self.arm = RobotModel(robot, game.cup, game.gravity_m_s2)
        self.game = game
        self.body = self.arm.new_body()
        self._skeleton = self.body.skeleton
        self._ball = make_ball(game.ball, game.cup)
        self._world = awake_world(STEP_S, game.gravity_m_s2)
        self._world.addSkeleton(self._skeleton)
        self._world.addSkeleton(self._ball)
        arm = self.arm
        self._friction = JointFriction(
            self.body.joints,
            arm.friction,
            slow_rad_s=MAY_STOP_STEPS * STEP_S * arm.limits.acceleration_rad_s2,
            change_rad_s=STEP_S * arm.mobility(arm.home_rad),
        )
        self._drive = Drive(arm.limits, STEP_S)
        self._kp = robot.stiffness_1_s2
        self._kd = 2.0 * math.sqrt(robot.stiffness_1_s2)
        self._least_nm = -arm.limits.effort_nm
        self._ones = np.ones(len(self.arm.joint_names))
        self.perturb(NO_ERRORS)
        self.reset(self.arm.home_rad)

    def perturb(self, errors: WorldErrors) -> None:
        """Take on these errors from the next ``reset`` on."""
        rope = self.game.rope
        self._errors = errors
        self._rope = (rope.length_m * errors.rope_scale, rope.stiffness_n_m, rope.damping_n_s_m)
        self._friction.set_unknown(errors.joint_friction_nm, errors.joint_friction_share)
        set_restitution(self.body.cup, self.game.cup.restitution if errors.restitution is None else errors.restitution)

    def reset(self, position_rad: Array) -> None:
        """The arm at rest in ``position_rad`` (n,), the ball hanging still, the clock at 0."""
        self._skeleton.resetVelocities()
        self._skeleton.resetAccelerations()
        self._skeleton.resetGeneralizedForces()
        self._skeleton.setPositions(position_rad)
        self._skeleton.clearExternalForces()
        length, stiffness, _ = self._rope
        length += self.game.ball.mass_kg * self.game.gravity_m_s2 / stiffness
        aside = self._errors.ball_start_m
        x, y, z = self.body.tie.getCOM().tolist()
        self._ball.setPositions([x + aside, y, z - math.sqrt(length**2 - aside**2)])
        self._ball.resetVelocities()
        self._ball.resetAccelerations()
        self._drive.reset(position_rad)
        self._world.setTime(0.0)
        self._steps = 0
        self.t_s = 0.0
        self.effort_nm = np.zeros(len(self._ones))
        self.tension_n = self.game.ball.mass_kg * self.game.gravity_m_s2
        self._pull: tuple[float, float, float] | None = (0.0, 0.0, self.tension_n)
        self._observe()

    def put_ball(self, place_m: Sequence[float], velocity_m_s: Sequence[float]) -> None:
        """Put the ball at ``place_m`` (3,) in the world, moving with ``velocity_m_s`` (3,)."""
        self._ball.setPositions(list(place_m))
        self._ball.setVelocities(list(velocity_m_s))
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

        ``noise_rad`` is added to the angles read, ``feedforward_nm`` to the torque commanded; the motors clip the sum
        to their limits. Raises SimulationError, naming the joint, where a torque would not be finite.
        """
        skeleton = self._skeleton
        drive = self._drive
        wanted = self._kd * (drive.mean_rad_s - self.velocity_rad_s)
        wanted += self._kp * (drive.position_rad - self.position_rad - noise_rad)
        wanted += drive.follow(position_rad, velocity_rad_s, acceleration_rad_s2)
        if not math.isfinite(wanted.dot(self._ones)):
            self._abort(wanted)
        skeleton.setAccelerations(wanted)
        skeleton.computeInverseDynamics(False, False, False)
        effort = (
            skeleton.getForces() + self._friction.compensation(drive.mean_rad_s, self.velocity_rad_s) + feedforward_nm
        )
        if not math.isfinite(effort.dot(self._ones)):
            self._abort(effort)
        self.effort_nm = np.minimum(np.maximum(effort, self._least_nm), self.arm.limits.effort_nm)
        skeleton.setForces(self.effort_nm + self._friction.torque(self.velocity_rad_s))
        tie = self.body.tie
        bx, by, bz = self.ball_m
        cx, cy, cz = self.tie_m
        vx, vy, vz = self.ball_m_s
        if not abs(bx) + abs(by) + abs(bz) + abs(vx) + abs(vy) + abs(vz) < FAR:
            self._abort_ball()
        ux, uy, uz = self.tie_m_s
        drag = -self.game.ball.drag_n_s_m
        self._pull = pull = rope_force(bx - cx, by - cy, bz - cz, vx - ux, vy - uy, vz - uz, *self._rope)
        if pull is None:
            self.tension_n = 0.0
            self._ball.setForces([drag * vx, drag * vy, drag * vz])
        else:
            fx, fy, fz = pull
            self.tension_n = math.sqrt(fx * fx + fy * fy + fz * fz)
            self._ball.setForces([fx + drag * vx, fy + drag * vy, fz + drag * vz])
            tie.addExtForce([-fx, -fy, -fz])
        self._world.step()
        self._steps += 1
        self.t_s = self._steps * STEP_S
        self._observe()

    def wrist_wrench(self) -> Array:
        """What a sensor between the tip link and the handle feels after the last step: (6,), force [N], torque [Nm].

        It is what handle, cup, rope and ball exert on the tip link, in the tip link's frame at its origin: the weight
        of the tool at rest, its inertia in motion, the pull of the rope and the blow of the ball.
        """
        body, skeleton = self.body, self._skeleton
        if self._pull is not None:
            body.tie.addExtForce([-one for one in self._pull])
        for contact in self._world.getLastCollisionResult().getContacts():
            if contact.collisionObject1.getShapeFrame().asShapeNode().getBodyNodePtr() == body.cup:
                body.cup.addExtForce(contact.force, contact.point, False, False)
            elif contact.collisionObject2.getShapeFrame().asShapeNode().getBodyNodePtr() == body.cup:
                body.cup.addExtForce(-contact.force, contact.point, False, False)
        skeleton.computeInverseDynamics(True, False, False)
        held = np.array(body.cup.getBodyForce())
        skeleton.clearExternalForces()
        turn, at = body.tool_in_tip.rotation(), body.tool_in_tip.translation()
        force = turn @ held[3:]
        return -np.concatenate([force, turn @ held[:3] + np.cross(at, force)])

    @property
    def limited(self) -> bool:
        """Whether the drive had to change the last reference to keep to the joints' limits."""
        return self._drive.limited

    def ball_in_cup_m(self) -> Array:
        """The ball's centre in the cup's frame (3,): z along the axis from the tie point."""
        place = self.body.cup.getWorldTransform()
        return np.asarray(place.rotation().T @ (np.array(self.ball_m) - place.translation()))

    def ball_is_caught(self) -> bool:
        """Whether the ball's centre is inside the cup, below the rim: what a sensor in the cup would tell."""
        bx, by, bz = self.ball_m
        cx, cy, cz = self.tie_m
        if (bx - cx) ** 2 + (by - cy) ** 2 + (bz - cz) ** 2 > (2 * self.game.cup.depth_m) ** 2:
            return False
        x, y, z = self.ball_in_cup_m()
        cup = self.game.cup
        return bool(0.0 < z < cup.depth_m and math.hypot(x, y) < cup.radius_m)

    def _observe(self) -> None:
        skeleton, tie = self._skeleton, self.body.tie
        self.position_rad: Array = skeleton.getPositions()
        self.velocity_rad_s: Array = skeleton.getVelocities()
        self.ball_m: list[float] = self._ball.getPositions().tolist()
        self.ball_m_s: list[float] = self._ball.getVelocities().tolist()
        self.tie_m: list[float] = tie.getCOM().tolist()
        self.tie_m_s: list[float] = tie.getCOMLinearVelocity().tolist()

    def _abort(self, wanted: Array) -> None:
        bad = int(np.argmin(np.isfinite(wanted)))
        name = self.arm.joint_names[bad]
        message = f"the torque of joint '{name}' of {self.arm.settings.name} is {wanted[bad]} at {self.t_s:.3f} s"
        raise SimulationError(
            name, self.t_s, f"{message}; the simulation stops: check the reference and robot.stiffness_1_s2"
        )

    def _abort_ball(self) -> None:
        place, speed = np.array(self.ball_m).round(3).tolist(), np.array(self.ball_m_s).round(3).tolist()
        raise SimulationError(
            "ball",
            self.t_s,
            f"the ball is at {place} m with {speed} m/s at {self.t_s:.3f} s: the step of {STEP_S} s is too long for "
            "the rope or the contact; lower game.rope.stiffness_n_m and game.rope.damping_n_s_m or use a heavier ball",
        )
