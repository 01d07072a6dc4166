"""A game as another physics can play it again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.game.catch_game import Game
from kendama_cli.game.cup_cart import CartStep
from kendama_cli.game.scene_history import SceneHistory
from kendama_cli.log.messages import ReplayMessage
from kendama_cli.physics.rim_crossing import rim_miss_m
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

UPRIGHT = np.array([0.0, 0.0, 1.0])


def replay_message(
    index: int, game: Game, steps: Sequence[CartStep], history: SceneHistory, settings: GameSettings
) -> ReplayMessage:
    """The true ways of cup and ball where the robot reports them, else the tracked ones of an upright cup."""
    way = history.rollout() if history.reported else _tracked(steps)
    t_s, cup_m, axis, ball_m = way[:, 0], way[:, 1:4], way[:, 4:7], way[:, 7:]
    since_s = game.swing.duration_s
    miss_m = rim_miss_m(t_s, cup_m, ball_m, rim_m=settings.cup.rim_m, radius_m=settings.ball.radius_m, since_s=since_s)
    return ReplayMessage(
        index=index,
        rope_m=history.rope_m,
        ball_kg=settings.ball.mass_kg,
        drag_n_s_m=settings.drag[0],
        drag_n_s2_m2=settings.drag[1],
        restitution=settings.cup.restitution,
        since_s=since_s,
        caught=game.caught,
        miss_m=float("nan") if miss_m is None else miss_m,
        t_s=t_s,
        cup_m=cup_m.ravel(),
        cup_axis=axis.ravel(),
        ball_m=ball_m.ravel(),
    )


def _tracked(steps: Sequence[CartStep]) -> Array:
    states = [(one.t_s, one.exchange.state) for one in steps]
    return np.array([[t_s, *state.cup_in_world_m, *UPRIGHT, *state.ball_in_world_m] for t_s, state in states])
