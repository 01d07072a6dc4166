"""Rollouts of a swing-up: the reward of all, and one over time."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from kendama_cli.report.figure import Panel
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.style import BALL, CUP, EXPLORED, INK, OTHER, PAPER
from kendama_cli.report.tracks import Geometry, Path2D, cup_outline_m, running_median


def reward_panel(rollouts: pd.DataFrame, name: str, label: str, learned: float | None = None) -> Panel | None:
    """Draw the reward over rollouts with explored and greedy marks; a dashed line after ``learned`` rollouts."""
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
            axes.plot(
                index[~explored],
                running_median(reward[~explored], 10),
                color=CUP,
                lw=1.2,
                alpha=0.8,
                label="_running median, greedy",
            )
        if learned is not None:
            axes.axvline(learned, color=INK, lw=0.9, ls=(0, (4, 3)), label="_learned")
            axes.annotate(
                f"learned after {learned:.0f}",
                (learned, 0.04),
                xytext=(5, 0),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
            )
        low, high = min(0.0, float(reward.min())), max(0.0, float(reward.max()))
        axes.set_ylim(low - 0.07 * (high - low + 1), high + 0.07 * (high - low + 1))
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel(label)
        axes.set_ylabel("reward")
        legend_above(axes, columns=4)
    return made.panel("Reward per rollout")


def series_panel(steps: pd.DataFrame, name: str, title: str, catch_s: float | None = None) -> Panel:
    """Draw cup position, ball angle and action over time, from SwingState or TransferStep rows.

    Times count from ``catch_s`` by the same clock, else from the start.
    """
    steps = steps.iloc[:: max(1, len(steps) // 800)]
    t = steps["t_s"].to_numpy(np.float64) - (float(steps["t_s"].iloc[0]) if catch_s is None else catch_s)
    angle_deg = np.degrees(np.unwrap(steps["angle_rad"].to_numpy(np.float64)))
    with drawing(name, title, height_in=3.6) as made:
        position, angle, action = made.axes(3, share_x=True)
        position.plot(t, steps["x_m"], color=CUP, label="cup")
        position.set_ylabel("cup x [m]")
        angle.plot(t, angle_deg, color=BALL, label="ball")
        angle.set_ylabel("ball [°]")
        action.step(t, steps["action_m_s2"], where="post", color=OTHER, lw=1.1, label="action")
        action.set_ylabel("action [m/s²]")
        action.set_xlabel("time [s]" if catch_s is None else "time from the catch [s]")
        made.canvas.align_ylabels()
    return made.panel(title)


def swing_panel(name: str, title: str, paths: tuple[Path2D, Path2D], sizes: Geometry, at_s: float | None) -> Panel:
    """Draw cup and ball in the swing plane with a mark every 60 ms, and the cup's outline at ``at_s`` or the end."""
    cup, ball = paths
    with drawing(name, f"{title}: path of cup and ball in the swing plane", height_in=3.6) as made:
        axes = made.axes()[0]
        for body, colour, label, size in ((cup, CUP, "cup (tie point)", 3.0), (ball, BALL, "ball", 4.2)):
            axes.plot(body.x_m, body.z_m, color=colour, lw=1.0, alpha=0.8, label=f"_{label}, path")
            marks = body.at(np.arange(body.t_s[0], body.t_s[-1], 0.06))
            axes.plot(marks.x_m, marks.z_m, "o", color=colour, ms=size, mec=PAPER, mew=0.4, label=label)
        instant = cup.at(np.array([cup.t_s[-1] if at_s is None else at_s]))
        _draw_cup(axes, instant.x_m[0], instant.z_m[0], instant.tilt_rad[0], sizes)
        axes.set_xlabel("x [m]")
        axes.set_ylabel("z [m]")
        axes.set_aspect("equal", adjustable="datalim")
        legend_above(axes)
    return made.panel(title)


def _draw_cup(axes: Axes, x_m: float, z_m: float, tilt_rad: float, sizes: Geometry) -> None:
    """Draw the cup's outline with its tie point at (x, z)."""
    outline = cup_outline_m(sizes.cup)
    c, s = np.cos(tilt_rad), np.sin(tilt_rad)
    turned = outline @ np.array([[c, -s], [s, c]])
    axes.plot(x_m + turned[:, 0], z_m + turned[:, 1], color=INK, lw=1.6, label="_cup outline", zorder=4)
