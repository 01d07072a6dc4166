"""A cup that a hand carries, with the ball on its rope: no arm, the cup is where the hand or a recording puts it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.motion.sampling import columns_at
from kendama_cli.physics.rim_crossing import catch_from_s
from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.cup import attach_cup
from kendama_cli.robot_model.dart_library import awake_world, dartpy
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.rollout import FlightRecord
from kendama_cli.simulation.dart.world import STEP_S

UP = np.array([0.0, 0.0, 1.0])
PLACE = 4
"""Numbers of a place: x, y, z of the tie point [m] and the cup's tilt about y [rad]."""


@dataclass(frozen=True)
class HandState:
    """All that a HandWorld is at one instant; see ``HandWorld.go_back``."""

    place: Array
    place_s: Array
    ball_m: Array
    ball_m_s: Array
    force_n: Array
    steps: int


class HandWorld:
    """The cup at a given place in every step, moved by joints that nothing can push back; the ball hangs and flies.

    ``place`` (4,) is x, y, z of the tie point [m] and the tilt about y [rad], positive toward +x. ``force_n`` (3,) is
    what the hand feels of rope and ball in the last step: the rope's reaction and the ball's push on the cup.
    """

    def __init__(self, game: GameSettings) -> None:
        self.game = game
        self._skeleton, joints, holder = _moved_body()
        cup, tie = attach_cup(self._skeleton, holder, dartpy.math.Isometry3(), game.cup)
        for joint in joints:
            joint.setActuatorType(dartpy.dynamics.ActuatorType.ACCELERATION)
        body = Body(self._skeleton, joints, holder, cup, tie, dartpy.math.Isometry3())
        self.ball = TetheredBall(game, body)
        self.reset(np.zeros(PLACE))

    def reset(self, place: Array) -> None:
        """Put the cup at rest at ``place`` (4,), the ball hanging still under it, the clock at 0."""
        # a new world: a solver would start from what it found before
        self._world = awake_world(STEP_S, self.game.gravity_m_s2)
        self._world.addSkeleton(self._skeleton)
        self._world.addSkeleton(self.ball.skeleton)
        self.place = np.array(place, dtype=np.float64)
        self._skeleton.setPositions(self.place)
        self._skeleton.resetVelocities()
        self._skeleton.resetAccelerations()
        self._skeleton.clearExternalForces()
        self._steps, self.t_s = 0, 0.0
        self.ball.hang(0.0)
        self.force_n: Array = self.game.ball.mass_kg * self.game.gravity_m_s2 * -UP

    def step(self, place: Array) -> None:
        """Carry the cup evenly to ``place`` (4,) within STEP_S; raises SimulationError where the ball is far away."""
        self._skeleton.setVelocities((place - self.place) / STEP_S)
        ball, before_m_s = self.ball, self.ball.velocity_m_s
        ball.pull(self.t_s)
        self._world.step()
        self.place = np.array(place, dtype=np.float64)
        self._steps += 1
        self.t_s = self._steps * STEP_S
        ball.observe()
        # momentum: what neither gravity nor air gave the ball came from rope and cup, and they feel the opposite
        given = self.game.ball.mass_kg * ((ball.velocity_m_s - before_m_s) / STEP_S + self.game.gravity_m_s2 * UP)
        self.force_n = ball.drag_n - given

    def moment(self) -> HandState:
        """Return the present state, to which ``go_back`` can return."""
        speeds = self._skeleton.getVelocities()
        return HandState(self.place, speeds, self.ball.position_m, self.ball.velocity_m_s, self.force_n, self._steps)

    def go_back(self, to: HandState) -> None:
        """Restore that state of this world; what follows may differ in rounding from what followed before."""
        self.place, self.force_n, self._steps = to.place, to.force_n, to.steps
        self.t_s = self._steps * STEP_S
        self._skeleton.setPositions(self.place)
        self._skeleton.setVelocities(to.place_s)
        self.ball.put(to.ball_m.tolist(), to.ball_m_s.tolist())


def _moved_body() -> tuple[Any, tuple[Any, ...], Any]:
    """Make a skeleton of three slides and a hinge about y, one after the other: (skeleton, joints, last body)."""
    skeleton = dartpy.dynamics.Skeleton("hand")
    slide, body = skeleton.createPrismaticJointAndBodyNodePair()
    joints = [slide]
    for _ in range(2):
        slide, body = skeleton.createPrismaticJointAndBodyNodePair(body)
        joints.append(slide)
    for joint, axis in zip(joints, np.eye(3), strict=True):
        joint.setAxis(axis)
    hinge, body = skeleton.createRevoluteJointAndBodyNodePair(body)
    hinge.setAxis([0.0, 1.0, 0.0])
    return skeleton, (*joints, hinge), body


@dataclass(frozen=True)
class Swing:
    """A swing at n instants, 1 ms apart: the cup's tie point and the ball's centre."""

    t_s: Array
    """(n,)"""
    cup_m: Array
    """(n, 3)"""
    ball_m: Array
    """(n, 3)"""
    slack: Array
    """(n,): whether the rope is slack."""
    caught: bool
    """True if the ball lies in the cup at the end, and came into it as the catch of the path: see RolloutResult."""
    miss_m: float | None
    """Distance along x from the cup's axis at which that descent reaches the rim's plane; None without one."""
    caught_later: bool
    """True if the ball lies in the cup otherwise: off the rim, or on a later descent."""


def carry_cup(
    game: GameSettings, t_s: Array, cup_m: Array, *, rope_m: float | None, aside_m: float, after_s: float
) -> Swing:
    """Simulate the ball under an upright cup at ``cup_m`` (n, 3) at ``t_s`` (n,), then at rest for ``after_s``.

    It hangs still at first, ``aside_m`` along x from rest, on the game's rope or on one of ``rope_m``. Raises
    SimulationError where the ball is flung away.
    """
    if rope_m is not None:
        game = dataclasses.replace(game, rope=dataclasses.replace(game.rope, length_m=rope_m))
    instants = np.arange(round((t_s[-1] - t_s[0] + after_s) / STEP_S) + 1) * STEP_S
    cup = columns_at(instants + t_s[0], t_s, cup_m)
    upright = np.column_stack([cup, np.zeros(len(cup))])
    world = HandWorld(game)
    world.reset(upright[0])
    world.ball.hang(aside_m)
    flight = FlightRecord(world.ball, catch_from_s(instants, cup))
    ball_m, slack = np.empty_like(cup), np.zeros(len(cup), dtype=bool)
    ball_m[0] = world.ball.position_m
    for k in range(1, len(cup)):
        world.step(upright[k])
        flight.observe(float(instants[k]))
        ball_m[k], slack[k] = world.ball.position_m, world.ball.tension_n == 0.0
    miss_m = None if flight.miss_m is None else float(flight.miss_m[0])
    later = world.ball.is_in_cup() and not flight.caught
    return Swing(instants, cup, ball_m, slack, flight.caught, miss_m, later)
