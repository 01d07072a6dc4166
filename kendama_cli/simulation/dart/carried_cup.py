"""Motion of the ball when the cup is carried along a path: without an arm, in DART."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from kendama_cli.motion.sampling import columns_at
from kendama_cli.physics.rim_crossing import catch_from_s
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.flight_record import FlightRecord
from kendama_cli.simulation.dart.hand_world import HandWorld
from kendama_cli.simulation.dart.world import STEP_S


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
    """Whether the ball lies in the cup at the end, and came into it as the catch of the path: see RolloutResult."""
    miss_m: float | None
    """How far beside the cup's axis, along x, that descent reaches the rim's plane; None without one."""
    caught_later: bool
    """Whether the ball lies in the cup otherwise: off the rim, or on a later descent."""


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
