"""Figures of fit and offline: predicted angles, the reward in the model, and one policy in model and world."""

from __future__ import annotations

import numpy as np

from kendama_cli.log.messages import RolloutMessage
from kendama_cli.plugins.offline.messages import PolicySwingMessage, PredictionMessage
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import MUTED, SERIES

MODELS = "identified", "network", "wrong"


def prediction_figures(log: StageLog) -> list[Figure]:
    """Return the ball's angle in one rollout that no model was fitted to, and as predicted each second anew."""
    table = log.table("/fit/prediction", PredictionMessage)
    if table.empty:
        return []
    one = table[table["rollout"] == table["rollout"].iloc[0]]
    with drawing("fit-prediction", "Predicted angle of the ball") as made:
        axes = made.axes()[0]
        axes.plot(one["t_s"], np.degrees(one["world_rad"]), color=MUTED, lw=3, label="world")
        for color, name in zip(SERIES, MODELS, strict=False):
            axes.plot(one["t_s"], np.degrees(one[f"{name}_rad"]), color=color, lw=1, label=name)
        axes.set(xlabel="time [s]", ylabel="angle [°]")
        legend_above(axes)
    caption = (
        "Angle of the ball in a rollout that no model was fitted to; predictions start from the true state each second."
    )
    return figure([caption], [made.panel("Prediction")], columns=1)


def policy_figures(log: StageLog) -> list[Figure]:
    """Return the reward of each rollout in the model, and the ball under the frozen policy in model and world."""
    rollouts = log.table("/offline/rollout", RolloutMessage)
    swing = log.table("/offline/swing", PolicySwingMessage)
    if rollouts.empty or swing.empty:
        return []
    with drawing("offline-reward", "Reward of each rollout in the model") as made:
        axes = made.axes()[0]
        for explored, color, name in ((1, MUTED, "exploring"), (0, SERIES[0], "greedy")):
            part = rollouts[rollouts["explored"].astype(bool) == bool(explored)]
            axes.plot(part["index"], part["reward"], ".", ms=4, color=color, label=name)
        axes.set(xlabel="rollout", ylabel="reward")
        legend_above(axes)
    with drawing("offline-swing", "Path of the ball under the frozen policy") as path:
        axes = path.axes()[0]
        for world, color, name in ((False, SERIES[0], "model"), (True, SERIES[1], "world")):
            part = swing[swing["world"].astype(bool) == world]
            axes.plot(part["ball_x_m"], part["ball_z_m"], color=color, lw=1, label=name)
        axes.set(xlabel="x [m]", ylabel="z above the tie [m]", aspect="equal")
        legend_above(axes)
    panels: list[Panel | None] = [made.panel("Learning"), path.panel("Model and world")]
    captions = [
        "Reward of each rollout in the model. The world is not asked.",
        "Path of the ball under the frozen policy without noise, through the flight: as the model has it, and in the"
        " world.",
    ]
    return figure(lettered(panels, captions), panels)
