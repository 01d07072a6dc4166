"""Replay in space of a transfer, and the game that a report shows."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.report.origin import robot_of
from kendama_cli.report.replay.camera_images import camera_images
from kendama_cli.report.replay.performance import Expected, Performance, performance
from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import last_start_s
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform
from kendama_cli.stages.transfer.messages import GameEstimateMessage, GameMessage
from kendama_cli.stages.transfer.prediction_panels import covariances

_SCENE = "/transfer/scene"


def replay(log: StageLog) -> list[Performance]:
    """Return the imitated swing's last attempt and one full game, as the robot carried them out."""
    robot = robot_of(log.settings).removeprefix("the ")
    number, start_s, end_s = shown_game(log)
    tried_s = last_start_s(log.table("/transfer/imitation/ball", FrameTransform))
    game = performance(
        log,
        "/transfer",
        f"Full game, {robot}",
        "robot",
        scene=_SCENE,
        start_s=start_s,
        end_s=end_s,
        expected=_expected(log, number),
        images=camera_images(log, "/transfer", start_s=start_s, end_s=end_s),
    )
    imitated = performance(
        log,
        "/transfer/imitation",
        f"Imitated swing, {robot}",
        "robot",
        scene=_SCENE,
        start_s=tried_s,
    )
    return [one for one in (imitated, game) if one is not None]


def _expected(log: StageLog, game: int) -> list[Expected]:
    estimates = log.table("/transfer/estimate", GameEstimateMessage)
    estimates = estimates[estimates["game"] == game]
    if estimates.empty:
        return []
    columns = ["x_m", "y_m", "z_m", "velocity_x_m_s", "velocity_y_m_s", "velocity_z_m_s"]
    rows = estimates[columns].to_numpy(np.float64).tolist()
    times = estimates[["t_s", "t_catch_s"]].to_numpy(np.float64).tolist()
    return [
        Expected(t_s, crossing_s, (x, y, z), (v_x, v_y, v_z), covariance[:2, :2])
        for (t_s, crossing_s), (x, y, z, v_x, v_y, v_z), covariance in zip(
            times, rows, covariances(estimates), strict=True
        )
    ]


def shown_game(log: StageLog) -> tuple[int, float, float]:
    """Return number, start and end of the game to show: the last caught, of those with images if there are any.

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
