"""The game that a report shows."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import last_start_s
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.transfer.messages import GameMessage


def shown_game(log: StageLog) -> tuple[int, float, float]:
    """Number, begin and end of the game to show: the last that was caught, else the last; the last stretch if none."""
    games = log.messages("/transfer/game", GameMessage)
    if not games.messages:
        return 0, last_start_s(log.table("/transfer/ball", FrameTransform)), math.inf
    caught = np.flatnonzero(games.column(lambda game: game.caught))
    row = int(caught[-1]) if len(caught) else len(games) - 1
    return games.messages[row].index, float(games.t_s[row - 1]) if row else -math.inf, float(games.t_s[row])
