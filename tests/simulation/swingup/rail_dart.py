"""The rail in DART, the referee of the compiled one: a cup on a rail along x, a ball in the swing plane, a rope."""

from __future__ import annotations

import math
from typing import Any

from kendama_cli.errors import SimulationError
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.robot_model.dart_library import awake_world, dartpy
from kendama_cli.settings.game import GameSettings


class DartRail:
    """One step at a time: the cup's acceleration is commanded, the rope's force and drag act on the ball (eq. 1).

    After ``start`` and every ``step`` the plain numbers hold the present: the cup's ``x_m`` and ``velocity_m_s``; the
    ball relative to the tie point, ``across_m`` along x and ``above_m`` along z, with their rates ``across_m_s`` and
    ``above_m_s``; and ``rope_force``, the rope's force on the ball in the step that led here, None while slack. The
    rope's reaction does not move the cup, whose acceleration is commanded.
    """

    __slots__ = (
        "_ball_x",
        "_ball_z",
        "_cup",
        "_drag",
        "_game",
        "_law",
        "_positions",
        "_push_x",
        "_push_z",
        "_stretched",
        "_velocities",
        "_world",
        "_world_step",
        "above_m",
        "above_m_s",
        "across_m",
        "across_m_s",
        "rope_force",
        "velocity_m_s",
        "x_m",
    )

    def __init__(self, game: GameSettings, step_s: float) -> None:
        self._game = game
        self.take_on(1.0, 1.0)
        self._world = awake_world(step_s, game.gravity_m_s2)
        scene = dartpy.dynamics.Skeleton("swing")
        rail, cup = scene.createPrismaticJointAndBodyNodePair()
        rail.setAxis([1.0, 0.0, 0.0])
        rail.setActuatorType(dartpy.dynamics.ActuatorType.ACCELERATION)
        _, ball = scene.createTranslationalJointAndBodyNodePair(None)
        cup.setInertia(_point_mass(game.cup.mass_kg))
        ball.setInertia(_point_mass(game.ball.mass_kg))
        self._world.addSkeleton(scene)
        self._cup = scene.getDof(0)
        self._ball_x, self._ball_z = scene.getDof(1), scene.getDof(3)
        self._push_x, self._push_z = self._ball_x.setForce, self._ball_z.setForce
        self._positions, self._velocities = scene.getPosition, scene.getVelocity
        self._world_step = self._world.step
        self.start(SwingState(0.0, 0.0, 0.0, 0.0))

    def take_on(self, rope_scale: float, drag_scale: float) -> None:
        """From the next ``start`` on the rope is so many times as long, and the air's drag so many times as large."""
        self._law, self._stretched = RopeLaw.of(self._game, rope_scale), TautRope.hanging(self._game, rope_scale)
        linear, quadratic = self._game.drag
        self._drag = (drag_scale * linear, drag_scale * quadratic)

    @property
    def in_cup(self) -> None:
        """None: nothing touches here."""
        return

    def start(self, state: SwingState) -> None:
        """Put cup and ball into ``state`` with the rope stretched as by the hanging ball."""
        ball = self._stretched.ball(state.angle_rad, state.rate_rad_s)
        self._cup.setPosition(state.x_m)
        self._cup.setVelocity(state.velocity_m_s)
        self._ball_x.setPosition(state.x_m + ball.across_m)
        self._ball_z.setPosition(ball.above_m)
        self._ball_x.setVelocity(state.velocity_m_s + ball.across_m_s)
        self._ball_z.setVelocity(ball.above_m_s)
        self.rope_force: tuple[float, float, float] | None = None
        self._read()

    def step(self, acceleration_m_s2: float) -> None:
        """Advance by one time step with the forces of the present state."""
        across_m_s, above_m_s = self.across_m_s, self.above_m_s
        air_m_s = self.velocity_m_s + across_m_s
        drag = self._drag[0] + self._drag[1] * math.sqrt(air_m_s * air_m_s + above_m_s * above_m_s)
        push_x, push_z = -drag * air_m_s, -drag * above_m_s
        exerted = rope_pull(self._law, (self.across_m, 0.0, self.above_m), (across_m_s, 0.0, above_m_s))
        self.rope_force = None if exerted.tension_n == 0.0 else exerted.force_n
        if exerted.tension_n > 0.0:
            push_x += exerted.force_n[0]
            push_z += exerted.force_n[2]
        self._push_x(push_x)
        self._push_z(push_z)
        self._cup.setCommand(acceleration_m_s2)
        self._world_step()
        self._read()

    @property
    def reference(self) -> tuple[float, float]:
        """The cup obeys at once: where it is and how fast."""
        return self.x_m, self.velocity_m_s

    @property
    def tension_n(self) -> float:
        """The rope's pull in the step that led here [N]."""
        return 0.0 if self.rope_force is None else math.hypot(self.rope_force[0], self.rope_force[2])

    def check_finite(self, t_s: float) -> None:
        """Raises SimulationError where the state is no longer finite, or far beyond any rope's stretch."""
        extent = abs(self.x_m) + abs(self.across_m) + abs(self.above_m)
        if not extent < 1e3 * self._law.length_m:
            raise SimulationError(
                "swing",
                t_s,
                f"the simulated swing left its domain at {t_s:.3f} s (extent {extent:g} m); "
                "lower learn.step_s or game.rope.stiffness_n_m",
            )

    def _read(self) -> None:
        position, velocity = self._positions, self._velocities
        x_m, velocity_m_s = position(0), velocity(0)
        self.x_m, self.velocity_m_s = x_m, velocity_m_s
        self.across_m, self.above_m = position(1) - x_m, position(3)
        self.across_m_s, self.above_m_s = velocity(1) - velocity_m_s, velocity(3)


def _point_mass(mass_kg: float) -> Any:
    inertia = dartpy.dynamics.Inertia()
    inertia.setMass(mass_kg)
    return inertia
