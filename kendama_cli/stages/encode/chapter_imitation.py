"""The figures of capture and encode: what the person did, and what the movement primitive made of it."""

from __future__ import annotations

from collections.abc import Iterable

import pandas as pd
from matplotlib.axes import Axes

from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import CUP, MUTED
from kendama_cli.report.tracks import Path2D, direction, track
from kendama_cli.stages.encode.chapter import reproduction_figures, weight_figures


def capture_figures(log: StageLog) -> list[Figure]:
    """The demonstrations: path of the cup, and its coordinates over time."""
    tracks = _by_child(log.table("/capture/cup"))
    if not tracks:
        return []
    n = len(tracks)
    with drawing("capture-path", "Path of the hand-held cup, side view", height_in=3.4) as path:
        axes = path.axes()[0]
        for one in tracks:
            axes.plot(one.x_m, one.z_m, color=CUP, lw=1.5 if n == 1 else 0.9, alpha=1 if n == 1 else 0.55)
            axes.plot(one.x_m[:1], one.z_m[:1], "o", color=CUP, ms=3.5)
        _side_view(axes)
    with drawing("capture-time", "Coordinates of the cup over time", height_in=3.4) as time:
        for axes, label in zip(time.axes(2, share_x=True), ("x", "z"), strict=True):
            for one in tracks:
                values = one.x_m if label == "x" else one.z_m
                axes.plot(one.t_s - one.t_s[0], values, color=CUP, lw=0.9 if n > 1 else 1.5, alpha=0.55 if n > 1 else 1)
            axes.set_ylabel(f"{label} [m]")
        axes.set_xlabel("time [s]")
    panels: list[Panel | None] = [Panel("Path of the cup", path.svg), Panel("Coordinates over time", time.svg)]
    one_or_many = "the demonstration" if n == 1 else f"each of the {n} demonstrations"
    return figure(
        lettered(
            panels,
            [
                f"Side view of the cup as the person moved it, in {one_or_many}, relative to where it begins (dot).",
                "The horizontal (x) and vertical (z) coordinate over time, in metres and seconds.",
            ],
        ),
        panels,
    )


def encode_figures(log: StageLog) -> list[Figure]:
    """The paper's Fig. 4: demonstrated and reproduced path of the cup; each demonstration by itself; the weights."""
    return [*_average_figures(log), *_own_figures(log), *weight_figures(log)]


def _own_figures(log: StageLog) -> list[Figure]:
    shown, made = log.table("/encode/demonstrated"), log.table("/encode/own")
    if len(shown) < 3 or len(made) < 3:
        return []
    along = direction(shown)
    one, other = (
        {str(name): track(part, along) for name, part in frame.groupby("child", sort=True) if len(part) > 1}
        for frame in (shown, made)
    )
    alike = {name for name in one if name in other and len(one[name].t_s) == len(other[name].t_s)}
    return reproduction_figures({n: one[n] for n in one if n in alike}, {n: other[n] for n in other if n in alike})


def _average_figures(log: StageLog) -> list[Figure]:
    shown = log.table("/encode/demonstrated")
    made = log.table("/encode/reproduced")
    along = direction(shown) if len(shown) > 2 else (1.0, 0.0)
    demonstrated, reproduced = _by_child(shown, along), _by_child(made, along)
    if not demonstrated and not reproduced:
        return []
    with drawing("encode-path", "Demonstrated and reproduced path of the cup", height_in=3.4) as path:
        axes = path.axes()[0]
        _both(axes, ((t.x_m, t.z_m) for t in demonstrated), ((t.x_m, t.z_m) for t in reproduced))
        _side_view(axes)
        legend_above(axes)
    with drawing("encode-time", "Demonstrated and reproduced coordinates over time", height_in=3.4) as time:
        for axes, label in zip(time.axes(2, share_x=True), ("x", "z"), strict=True):
            _both(
                axes,
                ((t.t_s - t.t_s[0], t.x_m if label == "x" else t.z_m) for t in demonstrated),
                ((t.t_s - t.t_s[0], t.x_m if label == "x" else t.z_m) for t in reproduced),
            )
            axes.set_ylabel(f"{label} [m]")
        axes.set_xlabel("time [s]")
    panels: list[Panel | None] = [
        Panel("Demonstrated and reproduced path", path.svg),
        Panel("Coordinates over time", time.svg),
    ]
    n = len(demonstrated)
    average = "the demonstration (grey)," if n == 1 else f"the {n} demonstrations (grey), whose parameters it averages,"
    return figure(
        [
            *lettered(
                panels,
                [
                    f"Side view: the path that the movement primitive reproduces (blue) over {average}"
                    " relative to the start.",
                    "The same over time; positions in metres.",
                ],
            ),
            "Compare with Fig. 4 of the paper.",
        ],
        panels,
    )


def _by_child(frame: pd.DataFrame, along: tuple[float, float] | None = None) -> list[Path2D]:
    """One path per child frame, each relative to its own start, all in one plane."""
    if len(frame) < 3:
        return []
    plane = direction(frame) if along is None else along
    tracks = [track(part, plane) for _, part in frame.groupby("child", sort=True) if len(part) > 1]
    return [one.moved(-one.x_m[0], -one.z_m[0]) for one in tracks]


def _both(
    axes: Axes, demonstrated: Iterable[tuple[object, object]], reproduced: Iterable[tuple[object, object]]
) -> None:
    shown = list(demonstrated)
    width, strength = (5.0, 0.4) if len(shown) == 1 else (0.9, 0.7)  # one alone shows as a seam under the line
    for number, (x, y) in enumerate(shown):
        label = "" if number else "demonstrated"
        axes.plot(x, y, color=MUTED, lw=width, alpha=strength, label=label)  # type: ignore[arg-type]
    for number, (x, y) in enumerate(reproduced):
        axes.plot(x, y, color=CUP, lw=1.6, label="" if number else "reproduced")  # type: ignore[arg-type]


def _side_view(axes: Axes) -> None:
    axes.set_xlabel("x [m]")
    axes.set_ylabel("z [m]")
    axes.set_aspect("equal", adjustable="datalim")
