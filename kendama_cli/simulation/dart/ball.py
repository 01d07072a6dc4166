"""The ball on its rope: a sphere that moves freely without turning, pulled by the tie point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Never

import numpy as np

from kendama_cli.errors import SimulationError
from kendama_cli.physics.rim_crossing import is_inside
from kendama_cli.physics.rope import RopeLaw
from kendama_cli.physics.taut_rope import stretch_m
from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.cup import set_restitution
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import BallSettings, CupSettings, GameSettings, SideTie
from kendama_cli.simulation.dart import rope_kernel
from kendama_cli.simulation.dart.arm_errors import NO_ERRORS, WorldErrors
from kendama_cli.simulation.dart.dynamics_kernel import KNOT, OVER, TIE, ArmArrays


def make_ball(ball: BallSettings, cup: CupSettings) -> Any:
    """Make a skeleton of one sphere on a translational joint, whose three positions are its centre in the world.

    DART multiplies the restitution of both bodies and takes the smaller friction: the ball has 1 and the cup's own.
    """
    skeleton = dartpy.dynamics.Skeleton("ball")
    _, body = skeleton.createTranslationalJointAndBodyNodePair()
    body.setName("ball")
    body.setInertia(_inertia(ball.mass_kg, ball.radius_m))
    node = body.createShapeNode(dartpy.dynamics.SphereShape(ball.radius_m))
    node.createCollisionAspect()
    surface = node.createDynamicsAspect()
    surface.setRestitutionCoeff(1.0)
    surface.setFrictionCoeff(cup.friction)
    return skeleton


def _inertia(mass_kg: float, radius_m: float) -> Any:
    """Return the inertia of a solid sphere."""
    return dartpy.dynamics.Inertia(mass_kg, np.zeros(3), np.eye(3) * 0.4 * mass_kg * radius_m**2)


class TetheredBall:
    """The ball m z'' = f_r + f_a + m g (eq. 1) on the rope to the cup of ``arm``, which feels the reaction.

    ``position_m`` and ``velocity_m_s`` (3,) are the ball's, ``tie_m`` and ``tie_m_s`` (3,) those of the cup's position,
    in the world; ``tension_n`` is the rope's tension in the last step, 0 where it is slack. ``rope``, ``pulled`` and
    ``force_n``, ``numbers`` and ``touch`` are the arrays on which compiled code works (rope_kernel, step_kernel).
    """

    def __init__(self, game: GameSettings, arm: Body, moved: ArmArrays | None = None) -> None:
        """Tie the ball to ``arm``; the motion of its cup is read from ``moved``, without that from DART."""
        self.skeleton = make_ball(game.ball, game.cup)
        self.game = game
        self._cup, self._tie = arm.cup, arm.tie
        self._knot = np.array(game.cup.tie_m) if isinstance(game.cup.tie, SideTie) else None
        self.pulled = np.zeros(13)
        self.pulled[rope_kernel.SIDE] = 1.0
        self._moved = moved
        self._reaction = self.pulled[rope_kernel.REACTION : rope_kernel.PIVOT]
        self._pivot_m = self.pulled[rope_kernel.PIVOT : rope_kernel.SIDE]
        self.force_n = np.zeros(3)
        self.touch = np.zeros(13)
        self.perturb(NO_ERRORS)

    def perturb(self, errors: WorldErrors) -> None:
        """Take on what of ``errors`` is the ball's, the rope's or the air's, from the next ``hang`` on."""
        self._law = law = RopeLaw.of(self.game, errors.rope_scale)
        over_tie_m = float(self._cup.getLocalCOM()[2])
        drag = (errors.drag_scale * one for one in self.game.drag)
        on_wall = [law.cup.side_m] if law.cup.side_m > 0.0 else []
        self.rope = np.array([*rope_kernel.rope_constants(law), *drag, over_tie_m, *on_wall])
        tilt_x, tilt_y = errors.gravity_tilt_rad, errors.gravity_tilt_y_rad
        y, z = math.cos(tilt_x) * math.sin(tilt_y), math.cos(tilt_x) * math.cos(tilt_y)
        self._leans = np.array([math.sin(tilt_x), y, 1.0 - z])
        self.mass_kg = errors.mass_scale * self.game.ball.mass_kg
        weight_n = self.mass_kg * self.game.gravity_m_s2
        rubbing = errors.tie_friction_m / law.length_m
        self.numbers = np.array([self.mass_kg, self.game.gravity_m_s2, rubbing, *weight_n * self._leans])
        self.skeleton.getBodyNode(0).setInertia(_inertia(self.mass_kg, self.game.ball.radius_m))
        set_restitution(self._cup, self.game.cup.restitution if errors.restitution is None else errors.restitution)

    def hang(self, aside_m: float, aside_y_m: float = 0.0) -> None:
        """Hang still under the tie, ``aside_m`` along x and ``aside_y_m`` along y from where it would come to rest."""
        weight_n = self.mass_kg * self.game.gravity_m_s2
        length = self._law.length_m + stretch_m(weight_n, self._law.stiffness_n_m)
        x, y, z = self._tied_m().tolist()
        aside_m, aside_y_m = aside_m + length * self._leans[0], aside_y_m + length * self._leans[1]
        self.skeleton.resetAccelerations()
        self.pulled[: rope_kernel.SIDE] = (0.0, 0.0, weight_n, weight_n, 0.0, 0.0, -weight_n, x, y, z)
        self.put([x + aside_m, y + aside_y_m, z - math.sqrt(length**2 - aside_m**2 - aside_y_m**2)], [0.0, 0.0, 0.0])

    def put(self, place_m: Sequence[float], velocity_m_s: Sequence[float]) -> None:
        """Put the ball at ``place_m`` (3,), moving with ``velocity_m_s`` (3,)."""
        self.skeleton.setPositions(list(place_m))
        self.skeleton.setVelocities(list(velocity_m_s))
        self.touch[:] = 0.0
        self.observe()

    def pull(self, t_s: float) -> None:
        """Set what rope and air do to the ball in the coming step; raises SimulationError where it is far away.

        What the rope does to the cup is in ``pulled``: whoever steps the world sets it, by ``react`` or otherwise.
        """
        over_tie = (self._cup.getCOM(), self._cup.getCOMLinearVelocity())
        if self._knot is not None:
            over_tie = _with_knot(self._cup, self._knot, over_tie)
        state = (self.position_m, self.velocity_m_s, self.tie_m, self.tie_m_s, *over_tie)
        if not rope_kernel.pull(*state, self.rope, self.pulled, self.force_n):
            self.abort(t_s)
        rope_kernel.pull_else(*state[:4], self.tension_n, self.numbers, self.force_n)
        self.skeleton.setForces(self.force_n)

    def is_in_cup(self) -> bool:
        """Return True if the ball's centre is inside the cup, below the rim, as a sensor in the cup would say."""
        apart, axis = self.position_m - self.tie_m, self.axis
        along = apart @ axis
        return is_inside(np.array([np.linalg.norm(apart - along * axis), 0.0, along]), self.game.cup)

    def react(self) -> None:
        """Let the tension of this step, or of the last one again, act on the cup, where the rope leaves it."""
        self._tie.addExtForce(self._reaction, self._pivot_m, False, False)

    def observe(self) -> None:
        """Read the state after a step."""
        self.position_m: Array = self.skeleton.getPositions()
        self.velocity_m_s: Array = self.skeleton.getVelocities()

    @property
    def tie_m(self) -> Array:
        """The cup's place in the world (3,)."""
        return np.asarray(self._tie.getCOM() if (at := self._moved) is None else at.mark_m(TIE).copy())

    @property
    def axis(self) -> Array:
        """The cup's unit axis in the world (3,)."""
        if self._moved is None:
            return np.asarray(self._cup.getWorldTransform().rotation()[:, 2])
        return np.asarray(self._moved.mark_m(OVER) - self._moved.mark_m(TIE))

    @property
    def tie_m_s(self) -> Array:
        """The velocity of the cup's position (3,)."""
        return np.asarray(self._tie.getCOMLinearVelocity() if (at := self._moved) is None else at.speeds[TIE].copy())

    @property
    def tension_n(self) -> float:
        """The rope's tension in the last step [N]."""
        return float(self.pulled[rope_kernel.TENSION])

    @property
    def rope_m(self) -> float:
        """The rope's length, untensioned, as it was sampled [m]."""
        return self._law.length_m

    @property
    def drag_n(self) -> Array:
        """The force in the last step (3,) [N] that is not the rope's: the air's, with errors more (pull_else)."""
        return np.asarray(self.force_n - self.pulled[:3])

    def _tied_m(self) -> Array:
        """Return the point in the world (3,) at which the rope is tied to the cup."""
        if self._knot is None:
            return self.tie_m
        return _knot_m(self._cup, self._knot) if self._moved is None else self._moved.mark_m(KNOT)

    def abort(self, t_s: float) -> Never:
        """Raise SimulationError: the ball has gone far away."""
        position, speed = self.position_m.round(3).tolist(), self.velocity_m_s.round(3).tolist()
        raise SimulationError(
            "ball",
            t_s,
            f"the ball is at {position} m with {speed} m/s at {t_s:.3f} s: the time step is too long for the rope or "
            "the contact; lower game.rope.stiffness_n_m and game.rope.damping_n_s_m or use a heavier ball",
        )


def _knot_m(cup: Any, knot: Array) -> Array:
    """Return the position in the world (3,) of the cup's point ``knot`` (3,)."""
    pose = cup.getWorldTransform()
    return np.asarray(pose.translation() + pose.rotation() @ knot)


def _with_knot(cup: Any, knot: Array, axis: tuple[Array, Array]) -> tuple[Array, Array]:
    """Place and velocity (6,) of a point of the cup's ``axis``, and after them of its position ``knot`` (3,)."""
    place_m = np.concatenate([axis[0], _knot_m(cup, knot)])
    return place_m, np.concatenate([axis[1], cup.getLinearVelocity(knot)])
