"""Scene of the referee in a run's replay: the game in which the two misses differ most, under both."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from kendama_cli.plugins.mujoco.cross_check.chapter import most_apart
from kendama_cli.plugins.mujoco.cross_check.messages import RefereeMessage
from kendama_cli.report.replay.performance import Performance, carried
from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import Array


def replay(log: StageLog) -> list[Performance]:
    """Return our game and the referee's, on the same path of the cup."""
    games = list(log.messages("/referee/game", RefereeMessage).messages)
    if not games:
        return []
    game = most_apart(games)
    name, ours, theirs = f"{game.stage}, game {game.index}", _poses(game, game.ours_m), _poses(game, game.referee_m)
    return [
        carried(log, f"{name}, ours", "simulation", ours, game.rope_m),
        carried(log, f"{name}, referee", "referee", theirs, game.rope_m),
    ]


def _poses(game: RefereeMessage, ball_m: Collection[float]) -> dict[str, tuple[Array, Array]]:
    """Return times (n,) and poses (n, 7) of cup and ball, by the shortest rotations of z to the cup's axis."""
    t_s, (x, y, z) = np.array(list(game.t_s)), _rows(game.cup_axis).T
    turns = np.column_stack([1 + z, -y, x, np.zeros_like(z)])
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(t_s), 1))
    return {
        "cup": (t_s, np.hstack([_rows(game.cup_m), turns])),
        "ball": (t_s, np.hstack([_rows(ball_m), still])),
    }


def _rows(values: Collection[float]) -> Array:
    return np.array(list(values)).reshape(-1, 3)
