"""Figures of transfer: learning on the robot, the games played there, and the imitated swing."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from kendama_cli.log.messages import JointExchangeMessage, RolloutMessage
from kendama_cli.motion.sampling import step_s
from kendama_cli.motion.tracking_delay import Tracking, tracking
from kendama_cli.report.animation import player
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.origin import robot_of
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import CUP, GOOD, INK, MUTED, PAPER, SERIES
from kendama_cli.report.swing_up_panels import reward_panel, series_panel, swing_panel
from kendama_cli.report.tables import number
from kendama_cli.report.thumbnails import thumbnails
from kendama_cli.report.tracks import Array, Geometry, Path2D, catch_time_s, last_start_s, pair
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.transfer.messages import GameMessage, ImitationMessage, TransferStepMessage
from kendama_cli.stages.transfer.performance import ahead, aim_panel, error_over_time_panel, shown_game

_SWUNG = "/transfer/imitation/ball"
_PARTS = (("swung_up", "swung up"), ("predicted", "catch predicted"), ("caught", "caught"))


def transfer_figures(log: StageLog) -> list[Figure]:
    """Draw rollouts on the robot; the games; one game in detail; the imitated swing; sent against measured."""
    alone = log.table("/transfer/game", GameMessage).empty and not log.table(_SWUNG, FrameTransform).empty
    own = sent_and_measured(log, "/transfer/imitation" if alone else "/transfer")
    return [*_learning(log), *_all_games(log), *_one_game(log), *_imitated(log), *own]


def _game_span_s(log: StageLog) -> tuple[float, float]:
    """Return when the cup of the shown game began and ended to move; the game's own bounds without its path."""
    _, start_s, end_s = shown_game(log)
    cup = log.table("/transfer/cup", FrameTransform)
    t_s = cup["t_s"].to_numpy(np.float64)
    moved = t_s[(t_s > start_s) & (t_s <= end_s)]
    return (float(moved[0]), float(moved[-1])) if len(moved) > 1 else (start_s, end_s)


def _learning(log: StageLog) -> list[Figure]:
    """Return the rewards of the rollouts, and the rates of success before and after them."""
    robot = robot_of(log.settings)
    rewards = [
        reward_panel(log.table("/transfer/rollout", RolloutMessage), "transfer-reward", f"rollout on {robot}"),
        reward_panel(
            log.table("/transfer/scratch/rollout", RolloutMessage), "transfer-scratch", "rollout from scratch"
        ),
    ]
    before, after = (log.metrics.get(f"success_rate_{when}") for when in ("before", "after"))
    rates = ""
    if isinstance(before, int | float) and isinstance(after, int | float):
        rates = f"Greedy trials that reached the goal: {before:.0%} before this learning, {after:.0%} after it."
    captions = lettered(
        rewards,
        [
            f"Reward of every rollout on {robot}, starting with the table learned in simulation: the sooner circles"
            " stay at the top, the better the table transfers.",
            f"Reward of every rollout on {robot} from an empty table, for comparison.",
        ],
    )
    return figure([*captions, "Filled: the goal was reached.", rates], rewards, columns=1)


def _all_games(log: StageLog) -> list[Figure]:
    outcomes, caption = _games(log.table("/transfer/game", GameMessage))
    return figure([caption], [outcomes], columns=1)


def _one_game(log: StageLog) -> list[Figure]:
    """Return one game as paths, over time, as its camera saw it, and as a video beside all errors of predictions."""
    number, start_s, end_s = shown_game(log)
    robot = robot_of(log.settings)
    paths = pair(log, "/transfer", start_s, end_s)
    caught_s = None if paths is None else catch_time_s(*paths, Geometry.of(log).cup)
    detail = [_path(log, paths), _series(log.table("/transfer/step", TransferStepMessage), number, caught_s)]
    images = thumbnails(log, "/transfer")
    closing = [_film(log, paths, number), error_over_time_panel(log)]
    return [
        *figure(
            lettered(
                detail,
                [
                    f"One game on {robot} in the swing plane: the ball swings up and falls into the cup. Marks every 60"
                    " ms; the cup is drawn at the catch, or at the end.",
                    f"Cup position, ball angle and commanded acceleration in one game, as {robot} reported them. After"
                    " the release the cup moves to the predicted catch.",
                ],
            ),
            detail,
        ),
        *figure(
            [
                "Camera images of one game from the last part of the swing-up on, with the detected ball (ring); the"
                " line joins all detections. Times are from the last detection."
            ],
            [images],
            columns=1,
        ),
        *figure(
            lettered(
                closing,
                [
                    "One game as an animation. Green: the predicted path of the ball and its crossing of the rim plane"
                    " (two standard deviations).",
                    "Error of the predicted catch over the time left until it: every estimate of all games, their"
                    " median, and the median of the stated standard deviation σ. Errors must lie below σ."
                    " The reference is the tracked ball, true to a few tenths of a millimetre.",
                ],
            ),
            closing,
        ),
    ]


def _imitated(log: StageLog) -> list[Figure]:
    """Return the last attempt at the imitated swing, and the misses of all attempts."""
    imitated = log.metrics.get("imitation_caught")
    ended = "" if imitated is None else "; it was caught" if imitated else "; it was missed"
    panels = [_imitation(log), aim_panel(log.messages("/transfer/imitation/rollout", ImitationMessage))]
    words = str(log.metrics.get("imitation") or "")
    captions = lettered(
        panels,
        [
            f"The imitated swing on {robot_of(log.settings)} in the swing plane, until shortly after the ball crossed"
            f" the rim plane{ended}. Marks every 60 ms.",
            "Above, distance of the ball from the planned cup in each rollout along x and y, or the words that told it;"
            " filled: caught. At the lower edge the ball never came over the rim. Below, the miss that the model"
            " predicts for the motion that was played, within the shaded range of all motions, and how far its goal"
            f" moved in flight. {words[:1].upper()}{words[1:]}{'.' if words else ''}",
        ],
    )
    return figure(captions, panels)


def _path(log: StageLog, paths: tuple[Path2D, Path2D] | None) -> Panel | None:
    if paths is None:
        return None
    sizes = Geometry.of(log)
    caught_s = catch_time_s(*paths, sizes.cup)
    if caught_s is not None:
        cup, ball = (body.between(body.t_s[0], caught_s + 0.12) for body in paths)
        paths = cup, ball
    return swing_panel("transfer-path", f"One game on {robot_of(log.settings)}", paths, sizes, caught_s)


def _film(log: StageLog, paths: tuple[Path2D, Path2D] | None, game: int) -> Panel | None:
    if paths is None:
        return None
    sizes = Geometry.of(log)
    start_s = float(paths[0].t_s[0])
    predictions = ahead(log, game, paths[0], start_s)
    cup, ball = (Path2D(body.t_s - start_s, body.x_m, body.z_m, body.tilt_rad) for body in paths)
    caught_s = catch_time_s(cup, ball, sizes.cup)
    poster_s = None if caught_s is None else caught_s - 0.1
    film = player("transfer-film", cup, ball, sizes, poster_s=poster_s, autoplay=False, predictions=predictions)
    return Panel("Animation of the game", film)


def _series(steps: pd.DataFrame, game: int, caught_s: float | None) -> Panel | None:
    """Return the steps of the game (its rollout is -1 - game), else of the last rollout that was logged."""
    if steps.empty:
        return None
    of_game = steps[steps["rollout"] == -1 - game]
    shown = of_game if len(of_game) > 1 else steps[steps["rollout"] == steps["rollout"].iloc[-1]]
    if len(shown) < 2:
        return None
    within = caught_s is not None and shown["t_s"].iloc[0] <= caught_s <= shown["t_s"].iloc[-1]
    return series_panel(shown, "transfer-series", "Cup, ball and action over time", caught_s if within else None)


def _games(games: pd.DataFrame) -> tuple[Panel | None, str]:
    """Return the parts of each game that succeeded, with the error of its prediction, and the sentence about them."""
    if games.empty:
        return None, ""
    number = np.arange(1, len(games) + 1)
    with drawing("transfer-games", "Outcome of every game", height_in=2.9, width_in=9.0) as made:
        error, outcome = made.canvas.subplots(2, 1, sharex=True, height_ratios=[3, 2])
        error_mm = games["prediction_error_mm"].to_numpy(np.float64)
        known = np.isfinite(error_mm) & games["predicted"].to_numpy(bool)
        caught = games["caught"].to_numpy(bool)
        kinds = ((known & caught, GOOD, GOOD, "caught"), (known & ~caught, MUTED, PAPER, "missed"))
        for of, colour, face, label in kinds:
            if of.any():
                error.plot(number[of], error_mm[of], "o", color=colour, mfc=face, ms=5, label=label)
        error.set_ylabel("prediction error [mm]")
        error.set_ylim(bottom=0)
        for row, (column, part) in enumerate(_PARTS):
            done = games[column].to_numpy(bool)
            outcome.plot(number[done], np.full(done.sum(), -row), "s", color=GOOD, ms=5.5, label=f"_{part}")
            outcome.plot(
                number[~done], np.full((~done).sum(), -row), "s", color=MUTED, mfc=PAPER, ms=5, label=f"_not {part}"
            )
        outcome.set_yticks([0, -1, -2], [title for _, title in _PARTS])
        outcome.tick_params(axis="y", labelcolor=INK, length=0)
        outcome.set_ylim(-2.6, 0.6)
        outcome.grid(visible=False)
        outcome.set_xlabel("game")
        outcome.set_xlim(0.3, len(games) + 0.7)
        outcome.xaxis.set_major_locator(MaxNLocator(integer=True))
    counts = ", ".join(f"{int(games[column].sum())} {title}" for column, title in _PARTS)
    return (
        made.panel("The games"),
        f"Outcome of {len(games)} full games: {counts}. Above, the error of the predicted catch; below, the parts that"
        " succeeded (filled): the first hollow square of a column shows where a game was lost.",
    )


def _imitation(log: StageLog) -> Panel | None:
    """Return the last attempt of the imitated swing, around the ball's descent through the rim plane."""
    paths = pair(log, "/transfer/imitation", last_start_s(log.table(_SWUNG, FrameTransform)))
    if paths is None:
        return None
    sizes = Geometry.of(log)
    caught_s = catch_time_s(*paths, sizes.cup)
    if caught_s is not None:
        cup, ball = (body.between(caught_s - 0.9, caught_s + 0.12) for body in paths)
        paths = cup, ball
    return swing_panel("transfer-imitation", "The imitated swing", paths, sizes, caught_s)


def sent_and_measured(log: StageLog, under: str) -> list[Figure]:
    """Return the joints in one game or, ``under`` /transfer/imitation, in the last rollout of the swing.

    Beside them stand delay and rms of each joint over all that was ever sent.
    """
    game = under == "/transfer"
    start_s, end_s = _game_span_s(log) if game else (last_start_s(log.table(_SWUNG, FrameTransform)), math.inf)
    told = log.messages("/transfer/exchange", JointExchangeMessage)
    if len(told) < 3:
        return []
    names = list(told.messages[0].joints)
    sent, measured = told.column(lambda one: one.sent_rad), told.column(lambda one: one.measured_rad)
    whole = tracking(told.t_s, sent, measured)
    shown = (told.t_s > start_s) & (told.t_s <= end_s)
    paths = pair(log, under, start_s, end_s)
    catch_s = None if paths is None else catch_time_s(*paths, Geometry.of(log).cup)
    panels: list[Panel | None] = [
        _angles(told.t_s[shown], (sent[shown], measured[shown]), names, catch_s) if shown.sum() > 1 else None,
        _joints(whole, names),
    ]
    delays = whole.delay_s[np.isfinite(whole.delay_s)]
    spread = f"; the delays lie from {1e3 * delays.min():.1f} to {1e3 * delays.max():.1f} ms" if len(delays) else ""
    minutes = number(len(told) * step_s(told.t_s) / 60)
    captions = lettered(
        panels,
        [
            f"Joint angles in {'one game' if game else 'the last rollout of the swing'}: as sent (grey, wide) and as"
            " measured (coloured). Where a colour leaves the grey, that joint lags.",
            f"Delay of each joint behind its command (bars){spread}, and its rms tracking error: in all (rings), and"
            f" what the delay does not explain (points). From {len(told)} control periods ({minutes} min). A joint that"
            " hardly moved has no bar.",
        ],
    )
    return figure(captions, panels)


def _angles(t_s: Array, angles: tuple[Array, Array], names: list[str], catch_s: float | None) -> Panel:
    sent, measured = angles
    t_s = t_s - (float(t_s[0]) if catch_s is None else catch_s)
    every = max(1, len(t_s) // 1500)
    with drawing("transfer-angles", "Joint angles as sent and as measured") as made:
        axes = made.axes()[0]
        for j, name in enumerate(names):
            label = f"_{name}, sent" if j else "sent"
            axes.plot(t_s[::every], np.degrees(sent[::every, j]), color=MUTED, lw=3.0, alpha=0.4, label=label)
            colour = SERIES[j % len(SERIES)]
            axes.plot(t_s[::every], np.degrees(measured[::every, j]), color=colour, lw=1.0, label=name)
        axes.set_xlabel("time [s]" if catch_s is None else "time from the catch [s]")
        axes.set_ylabel("angle [°]")
        legend_above(axes, columns=5)
    return made.panel("Sent and measured")


def _joints(whole: Tracking, names: list[str]) -> Panel:
    index = np.arange(len(names))
    with drawing("transfer-tracking", "Delay and rms of each joint") as made:
        axes = made.axes()[0]
        axes.bar(index, 1e3 * np.nan_to_num(whole.delay_s), color=CUP, alpha=0.35, width=0.6, label="delay")
        axes.set_ylabel("delay [ms]")
        axes.set_xticks(index, names, rotation=30, ha="right")
        right = axes.twinx()
        right.plot(index, 1e3 * whole.rms_rad, "o", mfc="none", color=SERIES[1], label="rms")
        right.plot(index, 1e3 * whole.residual_rms_rad, "o", ms=4, color=SERIES[1], label="rms without the delay")
        right.set_ylabel("measured less sent [mrad]")
        right.set_ylim(bottom=0)
        right.plot([], [], "s", color=CUP, alpha=0.35, ms=6, label="delay")
        legend_above(right)
    return made.panel("Delay and rms of each joint")
