"""The path of a guessed layout: as a sketch of characters, and as a figure."""

from __future__ import annotations

import io
from pathlib import Path

import matplotlib as mpl
import numpy as np

from kendama_cli.report.plot import drawing, legend_above
from kendama_cli.report.style import PAPER
from kendama_cli.schema.arrays import Array

ROWS, COLUMNS = 12, 48
PER_ROW = 2.0
"""A character is about twice as high as wide."""


def sketch(path_m: Array) -> list[str]:
    """Return the path (n, 3) seen from the side, x to the right and z up, as lines of text; S is its start, E its end.

    Both axes have one scale.
    """
    x, z = path_m[:, 0], path_m[:, 2]
    scale = max(float(np.ptp(x)) / (COLUMNS - 1), float(np.ptp(z)) / (PER_ROW * (ROWS - 1)), 1e-9)
    columns = np.rint((x - x.min()) / scale).astype(int)
    rows = np.rint((z.max() - z) / (PER_ROW * scale)).astype(int)
    cells = [[" "] * (int(columns.max()) + 1) for _ in range(int(rows.max()) + 1)]
    for row, column in zip(rows, columns, strict=True):
        cells[row][column] = "."
    cells[rows[-1]][columns[-1]], cells[rows[0]][columns[0]] = "E", "S"
    return ["".join(line).rstrip() for line in cells]


def picture(title: str, t_s: Array, path_m: Array, ending: str) -> bytes:
    """Return a figure of the path from the side, and of x, y and z over time, as a PNG or SVG by its ``ending``."""
    with drawing("layout", title, height_in=5.0) as drawn:
        side, over = drawn.axes(2)
        side.plot(path_m[:, 0], path_m[:, 2])
        side.plot(*path_m[0, [0, 2]], "o", label="start")
        side.plot(*path_m[-1, [0, 2]], "s", label="end")
        side.set(xlabel="x (in the swing plane) [m]", ylabel="z (up) [m]", aspect="equal", title=title)
        side.legend()
        for axis, values in zip("xyz", (path_m - path_m[0]).T, strict=True):
            over.plot(t_s, values, label=axis)
        over.set(xlabel="time [s]", ylabel="from the start [m]")
        legend_above(over)
    made = io.BytesIO()
    with mpl.rc_context({"svg.fonttype": "path", "svg.hashsalt": "layout"}):
        metadata = {"Date": None} if ending == "svg" else {}
        drawn.canvas.savefig(made, format=ending, dpi=150, facecolor=PAPER, metadata=metadata)
    return made.getvalue()


def ending_of(output: Path) -> str:
    """Return the kind of picture that a file's name asks for."""
    return output.suffix.lower().lstrip(".")
