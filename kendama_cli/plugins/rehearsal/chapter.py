"""The figures of rehearse: what was sent to the arm, what it measured, and what its twin did."""

from __future__ import annotations

import numpy as np
import pandas as pd

from kendama_cli.motion.sampling import columns_at
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import MUTED, SERIES
from kendama_cli.report.tables import number
from kendama_cli.report.tracks import Array
from kendama_cli.schema.foxglove import JointStates


def rehearsal_figures(log: StageLog) -> list[Figure]:
    """Return the angles as sent and as measured, the arm's tracking error, and its deviation from its twin."""
    sent, measured, ghost = (log.table(f"/rehearse/{name}", JointStates) for name in ("sent", "measured", "ghost"))
    if len(sent) < 2:
        return []
    names = [str(column).removesuffix(".position_rad") for column in _columns(sent)]
    angles = [_table(one) for one in (sent, measured, ghost)]
    t_s, ghost_s = sent["t_s"].to_numpy(np.float64), ghost["t_s"].to_numpy(np.float64)
    twin = columns_at(t_s, ghost_s, angles[2])
    panels: list[Panel | None] = [
        _angles(t_s, angles[0], angles[1], names),
        _difference("behind", "Measured less sent", t_s, angles[1] - angles[0], names),
        _difference("apart", "Measured less the twin's", t_s, angles[1] - twin, names),
    ]
    speed = number(100 * float(log.setting("rehearse", "speed")))
    captions = lettered(
        panels,
        [
            f"Joint angles at {speed} % of the motion's speed: as sent (grey, wide) and as measured (coloured).",
            "Tracking error of each joint in the same control period: its delay times its velocity, and what its"
            " controller does not hold.",
            "Deviation of each joint from the twin, which received the same commands: what the model does not know.",
        ],
    )
    return figure(captions, panels)


def _columns(table: pd.DataFrame) -> list[str]:
    return [str(name) for name in table.columns if str(name).endswith(".position_rad")]


def _table(table: pd.DataFrame) -> Array:
    return table[_columns(table)].to_numpy(np.float64)


def _angles(t_s: Array, sent: Array, measured: Array, names: list[str]) -> Panel:
    with drawing("rehearse-angles", "Joint angles as sent and as measured") as made:
        axes = made.axes()[0]
        for j, name in enumerate(names):
            label = f"_{name}, sent" if j else "sent"
            axes.plot(t_s, np.degrees(sent[:, j]), color=MUTED, lw=3.0, alpha=0.4, label=label)
            axes.plot(t_s, np.degrees(measured[:, j]), color=SERIES[j % len(SERIES)], lw=1.0, label=name)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("angle [°]")
        legend_above(axes, columns=5)
    return made.panel("Sent and measured")


def _difference(name: str, title: str, t_s: Array, difference: Array, names: list[str]) -> Panel:
    with drawing(f"rehearse-{name}", title) as made:
        axes = made.axes()[0]
        for j, joint in enumerate(names):
            axes.plot(t_s, 1e3 * difference[:, j], color=SERIES[j % len(SERIES)], lw=1.0, label=joint)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("difference [mrad]")
        legend_above(axes, columns=5)
    return made.panel(title)
