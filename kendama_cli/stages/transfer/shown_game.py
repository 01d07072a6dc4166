"""The game that a report shows."""

from __future__ import annotations

import math

from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import last_start_s
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform
from kendama_cli.stages.transfer.messages import GameMessage


def shown_game(log: StageLog) -> tuple[int, float, float]:
    """Number, begin and end of the game to show: the last that was caught, of those with images if there are any.

    Where none was caught, the last game; where there were no games, the last stretch.
    """
    games = log.messages("/transfer/game", GameMessage)
    if not games.messages:
        return 0, last_start_s(log.table("/transfer/ball", FrameTransform)), math.inf
    ends_s = [float(t_s) for t_s in games.t_s]
    spans = list(zip([-math.inf, *ends_s[:-1]], ends_s, strict=True))
    caught = [row for row, game in enumerate(games.messages) if game.caught] or [len(spans) - 1]
    pictured = [row for row in caught if _has_images(log, *spans[row])]
    row = (pictured or caught)[-1]
    return games.messages[row].index, *spans[row]


def _has_images(log: StageLog, start_s: float, end_s: float) -> bool:
    return any(
        bool(log.table(topic, CompressedImage)["t_s"].between(start_s, end_s).any())
        for topic in log.topics_under("/transfer/image/")
    )
