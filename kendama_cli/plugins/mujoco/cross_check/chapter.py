"""The figures of the referee: both misses of every game, and one game with both balls; that game as a scene."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from kendama_cli.plugins.mujoco.cross_check.messages import RefereeMessage
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.replay.performance import Performance, carried
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, GOOD, MUTED, OTHER, PAPER
from kendama_cli.report.tracks import Array

_MOST_MISS_MM = 150.0
_BEFORE_S = 0.9


def figures(log: StageLog) -> list[Figure]:
    """Return both sides of every game, and the last second of the one on which they differ most."""
    games = list(log.messages("/referee/game", RefereeMessage).messages)
    if not games:
        return []
    panels: list[Panel | None] = [_misses(games), _apart(games)]
    return figure(
        lettered(
            panels,
            [
                "Distance between ball and cup centre at the rim plane in the cross-check's simulation, over that"
                " in ours, for the same path of the cup: marks on the line agree. Filled: caught in the cross-check;"
                " squares: the rope hung slack in the swing, where its mass decides. Larger misses stand at the edge.",
                "The last second of the game in which both simulations differ most, in the swing plane: the cup, and"
                " the ball in either.",
            ],
        ),
        panels,
    )


def _misses(games: list[RefereeMessage]) -> Panel:
    ours = 1e3 * np.array([one.ours_miss_m for one in games])
    theirs = 1e3 * np.array([one.referee_miss_m for one in games])
    caught = np.array([one.referee_caught for one in games])
    slack = np.array([one.slack_in_swing for one in games])
    edge = min(_MOST_MISS_MM, 1.1 * float(np.nanmax(np.abs([ours, theirs]), initial=20.0)))
    with drawing("referee-misses", "Miss under the referee over our own", height_in=3.6) as made:
        axes = made.axes()[0]
        axes.plot([-edge, edge], [-edge, edge], color=MUTED, lw=0.7, label="_agreement")
        for hung, mark, how in ((~slack, "o", ""), (slack, "s", ", slack in the swing")):
            for which, colour, fill, label in ((caught, GOOD, GOOD, "caught"), (~caught, MUTED, PAPER, "missed")):
                if (which & hung).any():
                    x, y = (
                        np.clip(np.nan_to_num(miss[which & hung], nan=edge), -edge, edge) for miss in (ours, theirs)
                    )
                    axes.plot(x, y, mark, color=colour, mfc=fill, ms=4.5, label=label + how)
        axes.set_xlabel("our miss [mm]")
        axes.set_ylabel("referee's miss [mm]")
        axes.set_aspect("equal")
        legend_above(axes)
    return made.panel("Both misses")


def most_apart(games: list[RefereeMessage]) -> RefereeMessage:
    """Return the game in which the two misses differ most."""
    return max(games, key=lambda one: float(np.nan_to_num(abs(one.ours_miss_m - one.referee_miss_m), nan=-1.0)))


def _apart(games: list[RefereeMessage]) -> Panel:
    worst = most_apart(games)
    t_s = np.array(list(worst.t_s))
    late = t_s >= t_s[-1] - _BEFORE_S - 1.0
    with drawing("referee-paths", "Cup and both balls in the swing plane", height_in=3.6) as made:
        axes = made.axes()[0]
        for values, colour, label in (
            (worst.cup_m, CUP, "cup"),
            (worst.ours_m, BALL, "ball, ours"),
            (worst.referee_m, OTHER, "ball, referee"),
        ):
            way = np.array(list(values)).reshape(-1, 3)[late]
            axes.plot(way[:, 0], way[:, 2], color=colour, lw=1.1, label=label)
        axes.set_xlabel("x [m]")
        axes.set_ylabel("z [m]")
        axes.set_aspect("equal", adjustable="datalim")
        legend_above(axes, columns=3)
    return made.panel(f"{worst.stage}, game {worst.index}")


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
