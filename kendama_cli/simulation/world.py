"""The arm, the cup, the ball and the rope in one DART world, in the closed loop of the arm's controller."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.errors import SimulationError
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.arm import Arm
from kendama_cli.simulation.ball import make_ball
from kendama_cli.simulation.dart import dartpy
from kendama_cli.simulation.rope import rope_force

STEP_S = 0.001
"""Step of simulation and control: at 1 ms nothing tunnels up to 8 m/s and the rope is far from its stability limit."""

FRICTION_SPEED_RAD_S = 0.02
"""The controller's compensation of Coulomb friction turns its sign over about this speed."""


FAR = 1e4
"""A ball farther away or faster than this, in m and m/s, has left the domain of the model."""


@dataclass(frozen=True)
class WorldErrors:
    """How one world differs from what its controller believes (see settings.robot.Imperfection)."""

    rope_scale: float = 1.0
    ball_start_m: float = 0.0
    joint_friction_nm: float = 0.0


NO_ERRORS = WorldErrors()


class ArmWorld:
    """One world, stepped by ``step``; the state is in plain attributes after every step.

    The arm obeys q'' = H^-1 (tau - C q' - xi - g - J^T F) (PAPER.md eq. 2), the ball m z'' = f_r + f_a + m g (eq. 1),
    with the rope's reaction on the cup. The controller is computed torque:

        tau = H (q_ref'' + Kd (q_ref' - q') + Kp (q_ref - q)) + C q' + g + xi,   Kd = 2 sqrt Kp
    """

    def __init__(self, robot: RobotSettings, game: GameSettings) -> None:
        self.arm = Arm(robot, game.cup)
        self.game = game
        self._skeleton = self.arm.skeleton
        self._ball = make_ball(game.ball, game.cup)
        self._world = dartpy.simulation.World()
        self._world.setTimeStep(STEP_S)
        self._world.setGravity(np.array([0.0, 0.0, -game.gravity_m_s2]))
        sleep = self._world.getDeactivationOptions()
        sleep.mEnabled = False
        self._world.setDeactivationOptions(sleep)
        # never FCL, DART's default: it lets the ball tunnel
        self._world.getConstraintSolver().setCollisionDetector(dartpy.collision.BulletCollisionDetector())
        self._world.addSkeleton(self._skeleton)
        self._world.addSkeleton(self._ball)
        self._compensation = np.array(robot.coulomb_nm)
        self._kp = robot.stiffness_1_s2
        self._kd = 2.0 * math.sqrt(robot.stiffness_1_s2)
        self._ones = np.ones(len(self.arm.joint_names))
        self.perturb(NO_ERRORS)
        self.reset(self.arm.home_rad)

    def perturb(self, errors: WorldErrors) -> None:
        """Take on these errors from the next ``reset`` on."""
        rope = self.game.rope
        self._errors = errors
        self._rope = (rope.length_m * errors.rope_scale, rope.stiffness_n_m, rope.damping_n_s_m)
        for joint, known in zip(self.arm.joints, self.arm.settings.coulomb_nm, strict=True):
            joint.setCoulombFriction(0, known + errors.joint_friction_nm)

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
        x, y, z = self.arm.tie.getCOM().tolist()
        self._ball.setPositions([x + aside, y, z - math.sqrt(length**2 - aside**2)])
        self._ball.resetVelocities()
        self._ball.resetAccelerations()
        self._world.setTime(0.0)
        self._steps = 0
        self.t_s = 0.0
        self.effort_nm = np.zeros(len(self._ones))
        self.tension_n = 0.0
        self._observe()

    def put_ball(self, place_m: Sequence[float], velocity_m_s: Sequence[float]) -> None:
        """Put the ball at ``place_m`` (3,) in the world, moving with ``velocity_m_s`` (3,)."""
        self._ball.setPositions(list(place_m))
        self._ball.setVelocities(list(velocity_m_s))
        self._observe()

    def step(
        self, position_rad: Array, velocity_rad_s: Array, acceleration_rad_s2: Array, noise_rad: Array | float = 0.0
    ) -> None:
        """Advance by STEP_S toward the reference (n,) for this instant; ``noise_rad`` is added to the angles read.

        Raises SimulationError, naming the joint, where a torque would not be finite.
        """
        skeleton = self._skeleton
        wanted = acceleration_rad_s2 + self._kd * (velocity_rad_s - self.velocity_rad_s)
        wanted += self._kp * (position_rad - self.position_rad - noise_rad)
        if not math.isfinite(wanted.dot(self._ones)):
            self._abort(wanted)
        skeleton.setAccelerations(wanted)
        skeleton.computeInverseDynamics(False, True, False)
        effort = skeleton.getForces() + self._compensation * np.tanh(velocity_rad_s / FRICTION_SPEED_RAD_S)
        if not math.isfinite(effort.dot(self._ones)):
            self._abort(effort)
        skeleton.setCommands(effort)  # clips to the effort limits, setForces would not
        self.effort_nm = skeleton.getCommands()
        tie = self.arm.tie
        bx, by, bz = self.ball_m
        cx, cy, cz = self.tie_m
        vx, vy, vz = self.ball_m_s
        if not abs(bx) + abs(by) + abs(bz) + abs(vx) + abs(vy) + abs(vz) < FAR:
            self._abort_ball()
        ux, uy, uz = self.tie_m_s
        drag = -self.game.ball.drag_n_s_m
        pull = rope_force(bx - cx, by - cy, bz - cz, vx - ux, vy - uy, vz - uz, *self._rope)
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

    def ball_in_cup_m(self) -> Array:
        """The ball's centre in the cup's frame (3,): z along the axis from the tie point."""
        place = self.arm.cup.getWorldTransform()
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
        skeleton, tie = self._skeleton, self.arm.tie
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
