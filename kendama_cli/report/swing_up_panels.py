"""Rollouts of a swing-up: the reward of all, and one over time."""

from __future__ import annotations

import numpy as np
import pandas as pd

from kendama_cli.report.figure import Panel
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.style import BALL, CUP, EXPLORED, INK, OTHER, PAPER
from kendama_cli.report.tracks import running_median


def reward_panel(rollouts: pd.DataFrame, name: str, label: str, learned: float | None = None) -> Panel | None:
    """Reward over rollouts with explored and greedy marks; a dashed line after ``learned`` rollouts."""
    if rollouts.empty:
        return None
    explored = rollouts["explored"].to_numpy(bool)
    success = rollouts["success"].to_numpy(bool)
    index = rollouts["index"].to_numpy(np.float64)
    reward = rollouts["reward"].to_numpy(np.float64)
    with drawing(name, "Reward per rollout", height_in=3.0, width_in=9.0) as made:
        axes = made.axes()[0]
        kinds = ((explored, EXPLORED, "^", "explored"), (~explored, CUP, "o", "greedy"))
        for kind, colour, marker, title in kinds:
            for reached in (False, True):
                of = kind & (success == reached)
                if of.any():
                    axes.plot(
                        index[of],
                        reward[of],
                        marker,
                        color=colour,
                        mfc=colour if reached else PAPER,
                        ms=4.2,
                        mew=0.9,
                        label=f"{title}, {'goal reached' if reached else 'failed'}",
                    )
        if (~explored).sum() > 4:
            axes.plot(index[~explored], running_median(reward[~explored], 10), color=CUP, lw=1.2, alpha=0.8)
        if learned is not None:
            axes.axvline(learned, color=INK, lw=0.9, ls=(0, (4, 3)))
            axes.annotate(
                f"learned after {learned:.0f}",
                (learned, 0.04),
                xytext=(5, 0),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
            )
        low, high = min(0.0, float(reward.min())), max(0.0, float(reward.max()))
        axes.set_ylim(low - 0.07 * (high - low + 1), high + 0.07 * (high - low + 1))
        axes.set_xlabel(label)
        axes.set_ylabel("reward")
        legend_above(axes, columns=4)
    return Panel("Reward per rollout", made.svg)


def series_panel(steps: pd.DataFrame, name: str, title: str) -> Panel:
    """Cup position, ball angle and action over time, from SwingState or TransferStep rows."""
    steps = steps.iloc[:: max(1, len(steps) // 800)]
    t = steps["t_s"].to_numpy(np.float64) - float(steps["t_s"].iloc[0])
    angle_deg = np.degrees(np.unwrap(steps["angle_rad"].to_numpy(np.float64)))
    with drawing(name, title, height_in=3.6) as made:
        position, angle, action = made.axes(3, share_x=True)
        position.plot(t, steps["x_m"], color=CUP)
        position.set_ylabel("cup x [m]")
        angle.plot(t, angle_deg, color=BALL)
        angle.set_ylabel("ball [°]")
        action.step(t, steps["action_m_s2"], where="post", color=OTHER, lw=1.1)
        action.set_ylabel("action [m/s²]")
        action.set_xlabel("time [s]")
        made.canvas.align_ylabels()
    return Panel(title, made.svg)
