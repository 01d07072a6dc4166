"""Figures and replay of capture: the swings that were recorded."""

from __future__ import annotations

from typing import Any

from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.origin import swings_of
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.replay.performance import Performance, cup_alone
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import CUP
from kendama_cli.report.tracks import paths_by_child, side_view
from kendama_cli.schema.foxglove import FrameTransform


def capture_figures(log: StageLog) -> list[Figure]:
    """Return the demonstrations: path of the cup, and its coordinates over time."""
    tracks = paths_by_child(log.table("/capture/cup", FrameTransform))
    if not tracks:
        return []
    n, error_mm = len(tracks), log.metrics.get("likely_error_mm")
    with drawing("capture-path", "Path of the hand-held cup, side view", height_in=3.4) as path:
        axes = path.axes()[0]
        for number, one in enumerate(tracks, 1):
            look: Any = {"color": CUP, "lw": 1.5 if n == 1 else 0.9, "alpha": 1 if n == 1 else 0.55}
            axes.plot(one.x_m, one.z_m, label=f"_demonstration {number}", **look)
        axes.plot([0.0], [0.0], "o", color=CUP, ms=3.5, label="start")
        legend_above(axes)
        side_view(axes)
    with drawing("capture-time", "Coordinates of the cup over time", height_in=3.4) as time:
        for axes, label in zip(time.axes(2, share_x=True), ("x", "z"), strict=True):
            for number, one in enumerate(tracks, 1):
                values = one.x_m if label == "x" else one.z_m
                axes.plot(one.t_s - one.t_s[0], values, label=f"_demonstration {number}", **look)
                if isinstance(error_mm, float):
                    low, high = values - error_mm / 1e3, values + error_mm / 1e3
                    axes.fill_between(one.t_s - one.t_s[0], low, high, color=CUP, alpha=0.18, lw=0)
            axes.set_ylabel(f"{label} [m]")
        axes.set_xlabel("time [s]")
    panels: list[Panel | None] = [path.panel("Path of the cup"), time.panel("Coordinates over time")]
    banded = ""
    if isinstance(error_mm, float):
        banded = (
            f" The band is {error_mm:.0f} mm wide to each side, the likely error (rms) of inertial sensors; no bound."
        )
    one_or_many = "the demonstration" if n == 1 else f"each of the {n} demonstrations"
    return figure(
        lettered(
            panels,
            [
                f"{swings_of(log.metrics)} Side view of the cup in {one_or_many}, relative to its start."
                " The cup swings out, back and up; the more the paths agree, the more their average says.",
                f"Horizontal (x) and vertical (z) position of the cup over time in {one_or_many}. They may differ in"
                f" speed: averaging scales each to one duration.{banded}",
            ],
        ),
        panels,
    )


def replay(log: StageLog) -> list[Performance]:
    """Return the first demonstration: the cup alone."""
    cups = log.table("/capture/cup", FrameTransform)
    if cups.empty:
        return []
    name = min(cups["child"])
    origin = log.metrics.get("origin")
    found = cup_alone(cups[cups["child"] == name], f"Demonstration {name}" + (f" ({origin})" if origin else ""))
    return [found] if found is not None else []
