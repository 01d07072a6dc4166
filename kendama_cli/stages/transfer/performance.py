"""Replay of a transfer in space, the game that a report shows, misses of attempts, predictions in the games."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from kendama_cli.adaptation.aim import SHORT_M
from kendama_cli.log.reader import TypedMessages
from kendama_cli.report.animation import Ahead
from kendama_cli.report.figure import Panel
from kendama_cli.report.origin import robot_of
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.replay.camera_images import camera_images
from kendama_cli.report.replay.performance import Expected, Performance, performance
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import CUP, INK, MUTED, OTHER, PAPER, SERIES
from kendama_cli.report.tracks import Array, Path2D, direction, last_start_s
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform
from kendama_cli.stages.transfer.messages import GameEstimateMessage, GameMessage, ImitationMessage

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


def aim_panel(attempts: TypedMessages[ImitationMessage]) -> Panel | None:
    """Draw the misses of the attempts at the imitated swing, or the words for them, and below what was aimed at."""
    if not len(attempts):
        return None
    with drawing("transfer-aim", "Miss and aim of each rollout", width_in=3.4, height_in=3.6) as made:
        miss, aim = made.canvas.subplots(2, 1, sharex=True)
        _draw_misses(miss, attempts.messages)
        _draw_aims(aim, attempts.messages)
        for axes in (miss, aim):  # words and a motion as planned have no numbers to scale by
            low, high = axes.get_ylim()
            axes.set_ylim(min(low, -60.0), max(high, 60.0))
        aim.set_xlabel("rollout")
        aim.xaxis.set_major_locator(MaxNLocator(integer=True))
    return made.panel("Miss and aim of each rollout")


_COLOURS = {"x": CUP, "y": SERIES[1]}


def _draw_misses(axes: Axes, told: Sequence[ImitationMessage]) -> None:
    number, caught = np.array([one.index + 1 for one in told]), np.array([one.caught for one in told])
    axes.axhline(0, color=MUTED, lw=0.7, label="_no miss")
    for name, colour in _COLOURS.items():
        miss_mm = 1e3 * np.array([getattr(one, f"miss_{name}_m") for one in told])
        lost_mm = -1e3 * SHORT_M if name == "x" else 0.0
        shown = np.where(np.isfinite(miss_mm), miss_mm, [0.0 if one.outcome else lost_mm for one in told])
        axes.plot(number, shown, color=colour, lw=0.8, label=f"_{name}")
        for which, face in ((caught, colour), (~caught, PAPER)):
            label = name if which is caught or not caught.any() else f"_{name}"
            axes.plot(number[which], shown[which], "o", color=colour, mfc=face, ms=5, label=label)
    for one in told:
        axes.annotate(one.outcome, (one.index + 1, 0), (0, 7), textcoords="offset points", ha="center", fontsize=7)
    axes.set_ylabel("miss [mm]")
    legend_above(axes)


def _draw_aims(axes: Axes, told: Sequence[ImitationMessage]) -> None:
    number = [one.index + 1 for one in told]
    axes.axhline(0, color=MUTED, lw=0.7, label="_aim at the cup")
    for low, high in [one.path_m for one in told if len(one.path_m)][-1:]:
        axes.axhspan(1e3 * low, 1e3 * high, color=MUTED, alpha=0.12, lw=0, label="_path")
    for name, colour in _COLOURS.items():
        shift_mm = [1e3 * getattr(one, f"shift_{name}_m") for one in told]
        axes.plot(number, shift_mm, "o-", color=colour, lw=0.8, ms=4, label=f"goal, {name}")
    motion_mm = [math.nan if len(one.bent) else 1e3 * one.along_m for one in told]
    axes.plot(number, motion_mm, "s-", color=INK, lw=0.8, ms=4, label="motion")
    axes.set_ylabel("aim [mm]")
    legend_above(axes, columns=3)


_BINS = 10
_COLUMNS = ["t_s", "t_catch_s", "x_m", "y_m", "z_m", "velocity_x_m_s", "velocity_y_m_s", "velocity_z_m_s"]


def ahead(log: StageLog, game: int, cup: Path2D, start_s: float) -> list[Ahead]:
    """Return the estimates of ``game`` in the plane of the tracks; ``cup`` is its path there from ``start_s`` on."""
    estimates = log.table("/transfer/estimate", GameEstimateMessage)
    tracked = log.table("/transfer/cup", FrameTransform)
    if estimates.empty or tracked.empty:
        return []
    first = tracked[tracked["t_s"] >= start_s].iloc[0]
    balls = log.table("/transfer/ball", FrameTransform)
    along = np.array(direction(balls[balls["t_s"].between(start_s, start_s + float(np.ptp(cup.t_s)))]))
    of_game = estimates[estimates["game"] == game]
    t_s, crossing_s, x, y, z, v_x, v_y, v_z = of_game[_COLUMNS].to_numpy(np.float64).T
    position = (np.column_stack([x, y]) - first[["x_m", "y_m"]].to_numpy(np.float64)) @ along + cup.x_m[0]
    speed = np.column_stack([v_x, v_y]) @ along
    sigma = np.sqrt(np.maximum(np.einsum("i,nij,j->n", along, covariances(of_game)[:, :2, :2], along), 0.0))
    columns = (t_s - start_s, crossing_s - start_s, position, z - float(first["z_m"]) + cup.z_m[0], speed, v_z, sigma)
    return [Ahead(*row) for row in np.column_stack(columns).tolist()]


def error_over_time_panel(log: StageLog) -> Panel | None:
    """Draw the error and stated uncertainty of every estimate of the games over the time left to the crossing."""
    estimates, games = log.table("/transfer/estimate", GameEstimateMessage), log.table("/transfer/game", GameMessage)
    if estimates.empty or games.empty:
        return None
    rows = []
    for number in games.loc[np.isfinite(games["crossing_s"].to_numpy(np.float64)), "index"].tolist():
        game, of_game = games[games["index"] == number].iloc[0], estimates[estimates["game"] == number]
        error = np.linalg.norm(of_game[["x_m", "y_m"]].to_numpy(np.float64) - np.array(game["crossing_m"])[:2], axis=1)
        sigma = np.sqrt(np.maximum(np.trace(covariances(of_game)[:, :2, :2], axis1=1, axis2=2), 0.0))
        left = float(game["crossing_s"]) - of_game["t_s"].to_numpy(np.float64)
        rows.append(1e3 * np.column_stack([left, error, sigma]))
    if not rows:
        return None
    left_ms, error_mm, sigma_mm = np.vstack(rows).T
    group = pd.cut(pd.Series(left_ms), _BINS)
    medians = (
        pd.DataFrame({"left": left_ms, "error": error_mm, "sigma": sigma_mm}).groupby(group, observed=True).median()
    )
    with drawing("transfer-prediction", "Error over the time to the catch", width_in=4.6, height_in=3.1) as made:
        axes = made.axes()[0]
        axes.plot(left_ms, error_mm, ".", color=MUTED, ms=2.5, alpha=0.6, label="estimate")
        axes.plot(medians["left"], medians["error"], "o-", color=CUP, ms=3.5, lw=1.4, label="median")
        axes.plot(medians["left"], medians["sigma"], color=OTHER, lw=1.2, ls=(0, (4, 2)), label="stated σ")
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter("")
        axes.invert_xaxis()
        axes.set_xlabel("time to the catch [ms]")
        axes.set_ylabel("error [mm]")
        legend_above(axes, columns=3)
    return made.panel("Error of the predictions")


def covariances(estimates: pd.DataFrame) -> Array:
    """Return the covariances of the predicted positions (n, 3, 3) [m^2]."""
    return np.array(estimates["covariance_m2"].tolist(), dtype=np.float64).reshape(-1, 3, 3)
