"""Cup and ball of one motion, drawn in the swing plane."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from kendama_cli.report.figure import Panel
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.style import BALL, CUP, INK, PAPER
from kendama_cli.report.tracks import Geometry, Path2D, cup_outline_m


def swing_panel(name: str, title: str, paths: tuple[Path2D, Path2D], sizes: Geometry, at_s: float | None) -> Panel:
    """Cup and ball in the swing plane with a mark every 60 ms, and the cup's outline at ``at_s`` (else at the end)."""
    cup, ball = paths
    with drawing(name, f"{title}: path of cup and ball in the swing plane", height_in=3.6) as made:
        axes = made.axes()[0]
        for body, colour, label, size in ((cup, CUP, "cup (tie point)", 3.0), (ball, BALL, "ball", 4.2)):
            axes.plot(body.x_m, body.z_m, color=colour, lw=1.0, alpha=0.8)
            marks = body.at(np.arange(body.t_s[0], body.t_s[-1], 0.06))
            axes.plot(marks.x_m, marks.z_m, "o", color=colour, ms=size, mec=PAPER, mew=0.4, label=label)
        instant = cup.at(np.array([cup.t_s[-1] if at_s is None else at_s]))
        _draw_cup(axes, instant.x_m[0], instant.z_m[0], instant.tilt_rad[0], sizes)
        axes.set_xlabel("x [m]")
        axes.set_ylabel("z [m]")
        axes.set_aspect("equal", adjustable="datalim")
        legend_above(axes)
    return Panel(title, made.svg)


def _draw_cup(axes: Axes, x_m: float, z_m: float, tilt_rad: float, sizes: Geometry) -> None:
    """Draw the cup's outline with its tie point at (x, z)."""
    outline = cup_outline_m(sizes.cup)
    c, s = np.cos(tilt_rad), np.sin(tilt_rad)
    turned = outline @ np.array([[c, -s], [s, c]])
    axes.plot(x_m + turned[:, 0], z_m + turned[:, 1], color=INK, lw=1.6, solid_joinstyle="round", zorder=4)
