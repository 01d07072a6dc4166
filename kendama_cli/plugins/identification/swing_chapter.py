"""The figures of measure: the swing that dies away, and what the fit leaves of it."""

from __future__ import annotations

import numpy as np

from kendama_cli.plugins.identification.messages import FreeSwingMessage
from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, MUTED


def figures(log: StageLog) -> list[Figure]:
    """Return the angle over time, measured and fitted, and the distance between both."""
    table = log.table("/measure/swing", FreeSwingMessage)
    if table.empty:
        return []
    t_s = table["t_s"].to_numpy(np.float64)
    x, z, fitted_x, fitted_z = table[["x_m", "z_m", "fitted_x_m", "fitted_z_m"]].to_numpy(np.float64).T
    seen, fitted = np.degrees(np.arctan2(x, -z)), np.degrees(np.arctan2(fitted_x, -fitted_z))
    left_mm = 1e3 * np.hypot(x - fitted_x, z - fitted_z)
    with drawing("measure-swing", "Angle of the free swing over time") as made:
        axes = made.axes()[0]
        axes.plot(t_s, seen, color=BALL, lw=0.8, label="measured")
        axes.plot(t_s, fitted, color=CUP, lw=0.6, ls=(0, (4, 3)), label="fitted")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("angle [°]")
        legend_above(axes)
    with drawing("measure-left", "Residual of the fit over time") as rest:
        axes = rest.axes()[0]
        axes.plot(t_s, left_mm, ".", color=MUTED, ms=2, label="residual")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("distance [mm]")
        axes.set_ylim(bottom=0)
    panels: list[Panel | None] = [made.panel("The free swing"), rest.panel("Residual of the fit")]
    captions = [
        "Angle of the freely swinging ball under a cup at rest, measured and fitted by a pendulum with drag k1 + k2 v:"
        " the lines must cover each other to the end.",
        "Distance of the measured ball from the fitted one. A trend over time means that the model lacks something.",
    ]
    return figure(lettered(panels, captions), panels)
