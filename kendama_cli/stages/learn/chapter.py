"""The figures of learn: reward per rollout, the learned swing-up, and the table that does it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import ListedColormap

from kendama_cli.log.messages import RolloutMessage
from kendama_cli.report.animation import player
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing
from kendama_cli.report.replay.performance import Performance, performance
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import INK, LINE, MUTED, PAPER
from kendama_cli.report.swing_up_panels import reward_panel, series_panel, swing_panel
from kendama_cli.report.tracks import Geometry, pair
from kendama_cli.stages.learn.messages import QTableMessage, SwingStateMessage


def swingup_figures(log: StageLog) -> list[Figure]:
    """Return the paper's Fig. 5 and Fig. 6, and the learned table."""
    learning: list[Panel | None] = [
        reward_panel(log.table("/learn/rollout", RolloutMessage), "learn-reward", "rollout", _learned(log))
    ]
    steps = log.table("/learn/step", SwingStateMessage)
    trajectory = [_path(log), _series(steps)]
    film, table = _film(log), _table(log)
    return [
        *figure(
            [
                "Reward of every rollout: exploring rollouts follow a random harmonic motion, greedy ones the policy"
                " so far; filled marks reached the goal. Learning has succeeded where filled circles stay at the top."
                " Line: median of 21 greedy rollouts. After ten successes in a row the policy is frozen until it fails"
                " or is solved. Compare with Fig. 5 of the paper."
            ],
            learning,
            columns=1,
        ),
        *figure(
            [
                *lettered(
                    trajectory,
                    [
                        "The learned swing-up in the swing plane, one rollout of the frozen table without noise: each"
                        " half-swing carries the ball higher, until it flies into the cup. Marks every 60 ms; the cup"
                        " is drawn at the end.",
                        "The learned swing-up over time: position of the cup, angle of the ball (0 hanging, ±180 above"
                        " the cup) and the acceleration that the table chose.",
                    ],
                ),
                "Compare with Fig. 6 of the paper.",
            ],
            trajectory,
        ),
        *figure(
            lettered(
                [film, table],
                [
                    "The learned swing-up as an animation.",
                    "Greedy action of the learned table: the acceleration with the largest Q in every state. Ball angle"
                    " from left to right; each block is a bin of cup position and velocity, and the ball's angular"
                    " velocity rises over its rows. Grey: states never learned, all actions equal.",
                ],
            ),
            [film, table],
        ),
    ]


def _learned(log: StageLog) -> float | None:
    rollouts = log.metrics.get("rollouts_to_learned")
    return float(rollouts) if isinstance(rollouts, int | float) and log.metrics.get("learned") else None


def _path(log: StageLog) -> Panel | None:
    paths = pair(log, "/learn")
    return None if paths is None else swing_panel("learn-path", "The learned swing-up", paths, Geometry.of(log), None)


def _film(log: StageLog) -> Panel | None:
    paths = pair(log, "/learn")
    if paths is None:
        return None
    return Panel(
        "Animation of the swing-up", player("learn-film", *paths, Geometry.of(log), poster_s=None, autoplay=False)
    )


def _series(steps: pd.DataFrame) -> Panel | None:
    if len(steps) < 2:
        return None
    return series_panel(steps, "learn-series", "Cup, ball and action over time")


def _table(log: StageLog) -> Panel | None:
    """Return the greedy action per state, only for a table whose grid stands in the settings (position, velocity,
    angle,
    rate).
    """
    tables = log.messages("/learn/table", QTableMessage).messages
    learning: Mapping[str, Any] = next(
        (value for value in log.settings.values() if isinstance(value, Mapping) and "grid" in value), {}
    )
    grid, actions = learning.get("grid", {}), learning.get("actions_m_s2", [])
    if not tables or not {"position_edges_m", "velocity_edges_m_s", "angle_bins", "rate_edges_rad_s"} <= grid.keys():
        return None
    positions, velocities, rates = (
        len(grid[name]) + 1 for name in ("position_edges_m", "velocity_edges_m_s", "rate_edges_rad_s")
    )
    angles = int(grid["angle_bins"])
    last = tables[-1]
    q = np.array(tuple(last.values))
    if q.size != positions * velocities * angles * rates * len(actions):
        return None
    q = q.reshape(positions * velocities, angles, rates, len(actions)).transpose(0, 2, 1, 3)
    best = np.where(np.ptp(q, axis=-1) == 0, -1, q.argmax(axis=-1)).reshape(positions * velocities * rates, angles)
    best = np.roll(best, angles // 2, axis=1)  # hanging (0) in the centre
    shades = ["#0b4a78", "#63a6d6", "#f3efe6", "#f0a04b", "#a63c00"]
    picked = [shades[round(4 * n / max(1, len(actions) - 1))] for n in range(len(actions))]
    left = -(angles // 2 + 0.5) * 360 / angles
    with drawing("learn-table", "Greedy action for every state", height_in=3.9) as made:
        axes = made.axes()[0]
        image = axes.imshow(
            best,
            cmap=ListedColormap([LINE, *picked]),
            vmin=-1.5,
            vmax=len(actions) - 0.5,
            aspect="auto",
            interpolation="nearest",
            origin="lower",
            extent=(left, left + 360, 0, len(best)),
        )
        for line in range(rates, len(best), rates):
            axes.axhline(line, color=PAPER, label="_border", lw=1.4 if line % (rates * velocities) else 3.0)
        centers = [rates * (block + 0.5) for block in range(positions * velocities)]
        names = [f"x{block // velocities + 1}, v{block % velocities + 1}" for block in range(positions * velocities)]
        axes.set_yticks(centers, names)
        axes.set_xticks([-180, -90, 0, 90])
        axes.grid(visible=False)
        axes.set_xlabel("angle of the ball [°]")
        axes.set_ylabel("bin of cup position, cup velocity")
        bar = made.canvas.colorbar(image, ax=axes, location="top", aspect=40, pad=0.02, shrink=0.9)
        bar.set_ticks(
            [-1, *range(len(actions))], labels=["none", *(f"{value:g}".replace("-", "−") for value in actions)]
        )
        bar.set_label("acceleration [m/s²]", color=INK)
        bar.outline.set_edgecolor(MUTED)
    return made.panel(f"The table after {last.rollout} rollouts")


def replay(log: StageLog) -> list[Performance]:
    """Return the learned swing-up without noise: cup and ball, with the cup on its line."""
    found = performance(log, "/learn", "Learned swing-up, simulated", "simulation")
    return [found] if found is not None else []
