"""The figures of encode: what the movement primitive made of the demonstrations."""

from __future__ import annotations

from collections.abc import Iterable

from matplotlib.axes import Axes

from kendama_cli.report.figure import Figure, Panel, figure, lettered
from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.source import StageLog
from kendama_cli.report.style import CUP, MUTED
from kendama_cli.report.tracks import direction, paths_by_child, side_view, track
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.encode.chapter_reproduction import reproduction_figures, weight_figures


def encode_figures(log: StageLog) -> list[Figure]:
    """The paper's Fig. 4: demonstrated and reproduced path of the cup; each demonstration by itself; the weights."""
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
