"""The figures of encode: what the movement primitive made of the demonstrations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import columns_of, drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import BALL, CUP, MUTED, SERIES
from kendama_cli.report.tracks import Path2D, direction, paths_by_child, side_view, track
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.encode.messages import WeightsMessage


def encode_figures(log: StageLog) -> list[Figure]:
    """Return the paper's Fig. 4: demonstrated and reproduced path of the cup; each demonstration by itself; the
    weights.
    """
    return [*_average_figures(log), *_own_figures(log), *weight_figures(log)]


def _own_figures(log: StageLog) -> list[Figure]:
    shown, made = log.table("/encode/demonstrated", FrameTransform), log.table("/encode/own", FrameTransform)
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
    shown = log.table("/encode/demonstrated", FrameTransform)
    made = log.table("/encode/reproduced", FrameTransform)
    along = direction(shown) if len(shown) > 2 else (1.0, 0.0)
    demonstrated, reproduced = paths_by_child(shown, along), paths_by_child(made, along)
    if not demonstrated and not reproduced:
        return []
    with drawing("encode-path", "Demonstrated and reproduced path of the cup", height_in=3.4) as path:
        axes = path.axes()[0]
        _both(axes, ((t.x_m, t.z_m) for t in demonstrated), ((t.x_m, t.z_m) for t in reproduced))
        side_view(axes)
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
        path.panel("Demonstrated and reproduced path"),
        time.panel("Coordinates over time"),
    ]
    n = len(demonstrated)
    average = "the demonstration (grey)," if n == 1 else f"the {n} demonstrations (grey), whose parameters it averages,"
    return figure(
        [
            *lettered(
                panels,
                [
                    f"Side view: the cup's path as the movement primitive reproduces it (blue) over {average}"
                    " relative to the start. Blue must run through the grey bundle.",
                    f"Position of the cup over time: the primitive (blue) over {average} each from its start.",
                ],
            ),
            "Compare with Fig. 4 of the paper.",
        ],
        panels,
    )


def _both(
    axes: Axes, demonstrated: Iterable[tuple[object, object]], reproduced: Iterable[tuple[object, object]]
) -> None:
    shown = list(demonstrated)
    width, strength = (5.0, 0.4) if len(shown) == 1 else (0.9, 0.7)  # one alone shows as a seam under the line
    for number, (x, y) in enumerate(shown):
        label = f"_demonstrated {number + 1}" if number else "demonstrated"
        axes.plot(x, y, color=MUTED, lw=width, alpha=strength, label=label)  # type: ignore[arg-type]
    for number, (x, y) in enumerate(reproduced):
        axes.plot(x, y, color=CUP, lw=1.6, label=f"_reproduced {number + 1}" if number else "reproduced")  # type: ignore[arg-type]


COLUMNS = 4
MOST = 24
"""Small pictures that a page can take; further demonstrations are counted in the caption."""


def reproduction_figures(demonstrated: Mapping[str, Path2D], own: Mapping[str, Path2D]) -> list[Figure]:
    """Return each demonstration with the reproduction by its own primitive, and the distance between them over time."""
    names = [name for name in demonstrated if name in own]
    if not names:
        return []
    more = f" The first {MOST} of {len(names)} are shown." if len(names) > MOST else ""
    panels: list[Panel | None] = [
        # alone, it is the figure above
        _side_by_side(demonstrated, own, names[:MOST]) if len(names) > 1 else None,
        _distances(demonstrated, own, names),
    ]
    return figure(
        lettered(
            panels,
            [
                "Side view of every demonstration (grey), cut to its motion, and of the primitive fitted to it alone "
                f"(blue); above each, their distance in the swing plane. Blue must cover grey.{more}",
                "Distance of each demonstration from its own primitive over time, one line each. A peak shows where "
                "the basis functions are too few.",
            ],
        ),
        panels,
        columns=1,
    )


def _side_by_side(demonstrated: Mapping[str, Path2D], own: Mapping[str, Path2D], names: Sequence[str]) -> Panel:
    columns = min(columns_of(9.6, COLUMNS), len(names))
    rows = -(-len(names) // columns)
    title, height_in = "Each demonstration (grey) and its own primitive (blue)", 1.75 * rows + 0.3
    with drawing("encode-own", title, height_in=height_in, width_in=9.6) as made:
        grid = made.canvas.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in grid.flat[len(names) :]:
            axes.set_axis_off()
        for number, (axes, name) in enumerate(zip(grid.flat, names, strict=False)):
            there, played = demonstrated[name], own[name]
            axes.plot(there.x_m, there.z_m, color=MUTED, lw=4.0, alpha=0.4, label="_demonstrated")
            axes.plot(played.x_m, played.z_m, color=CUP, lw=1.1, label="_own primitive")
            apart = _distance_mm(there, played)
            deviation = f"{name}: {np.sqrt(np.mean(apart**2)):.2f} mm rms, {apart.max():.2f} at most"
            axes.set_title(deviation, loc="left", fontsize="small")
            axes.set_aspect("equal", adjustable="box")
            if number % columns == 0:
                axes.set_ylabel("z [m]")
            if number + columns >= len(names):
                axes.set_xlabel("x [m]")
                axes.xaxis.set_tick_params(labelbottom=True)
    return made.panel(title)


def _distances(demonstrated: Mapping[str, Path2D], own: Mapping[str, Path2D], names: Sequence[str]) -> Panel:
    title = "Distance of each primitive from its demonstration"
    with drawing("encode-error", title, height_in=2.2, width_in=9.6) as made:
        axes = made.axes()[0]
        for number, name in enumerate(names):
            there = demonstrated[name]
            colour = SERIES[number % len(SERIES)] if len(names) <= len(SERIES) else CUP
            strength = 0.85 if len(names) < 4 else 0.55
            axes.plot(
                there.t_s - there.t_s[0],
                _distance_mm(there, own[name]),
                color=colour,
                lw=1.0,
                alpha=strength,
                label=f"_{name}",
            )
        axes.set_ylim(bottom=0)
        axes.set_ylabel("distance [mm]")
        axes.set_xlabel("time [s]")
    return made.panel(title)


def weight_figures(log: StageLog) -> list[Figure]:
    """Return the weights of every coordinate: of each demonstration, and of the primitive that is the result."""
    table = log.table("/encode/weights", WeightsMessage)
    if table.empty:
        return []
    coordinates = list(dict.fromkeys(table["coordinate"]))
    height_in = 1.35 * len(coordinates) + 0.5
    with drawing("encode-weights", "Weights of the basis functions", height_in=height_in, width_in=9.6) as made:
        for axes, coordinate in zip(made.axes(len(coordinates), share_x=True), coordinates, strict=True):
            part = table[table["coordinate"] == coordinate]
            alone = _rows(part[part["demonstration"] != "reproduced"])
            for number, values in enumerate(alone if len(alone) > 1 else []):
                label = f"_demonstration {number + 1}" if number else "one demonstration"
                axes.plot(values, ".-", color=MUTED, lw=0.7, ms=3, alpha=0.6, label=label)
            for values in _rows(part[part["demonstration"] == "reproduced"]):
                axes.plot(values, "o-", color=BALL, lw=1.3, ms=3.2, label="result")
            axes.set_ylabel(f"w, {coordinate} [m]")
            axes.axhline(0, color=MUTED, lw=0.6, label="_zero")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
            if coordinate == coordinates[0]:
                legend_above(axes)
        axes.set_xlabel("number of the basis function, in order of time")
        axes.set_xlim(-0.5, max(len(values) for values in table["values"]) - 0.5)
    return figure(
        [
            "Weight of each basis function, by coordinate: of the resulting primitive (vermilion) and of each "
            "demonstration (grey), if there are several. Where the grey lines lie together, the demonstrations agree."
        ],
        [made.panel("Weights")],
        columns=1,
    )


def _rows(part: pd.DataFrame) -> Sequence[np.ndarray]:
    return [np.asarray(values, dtype=np.float64) for values in part["values"]]


def _distance_mm(there: Path2D, made: Path2D) -> np.ndarray:
    return 1e3 * np.hypot(there.x_m - made.x_m, there.z_m - made.z_m)
