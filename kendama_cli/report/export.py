"""The figures and tables of a report as files for a paper: SVG, PDF, CSV, LaTeX; the same bytes from the same logs."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.figure import Figure as Canvas
from matplotlib.patches import Rectangle

from kendama_cli.report.tables import label_and_unit, number

_FONTS: Any = {"pdf.fonttype": 42, "svg.fonttype": "path"}  # TrueType embedded; outlines
_LATEX = str.maketrans(
    {
        **{one: f"\\{one}" for one in "&%$#_{}"},
        "\\": r"\textbackslash{}",
        "^": r"\textasciicircum{}",
        "~": r"\textasciitilde{}",
        "\n": " ",
        "\r": " ",
        "−": "$-$",
        "–": "--",
        "°": r"$^\circ$",
        "²": "$^2$",
    }
)


class Files:
    """Receiver of each finished figure of ``drawing``; ``made`` holds the files' content by name."""

    def __init__(self) -> None:
        self.made: dict[str, bytes] = {}

    def figure(self, name: str, canvas: Canvas) -> None:
        """Keep ``canvas`` as ``name``.svg and ``name``.pdf, and the data in it as ``name``.csv."""
        self.made[f"{name}.csv"] = _text(_rows(canvas), _Row._fields)
        canvas.set_layout_engine("none")  # it is laid out
        without = {"Creator": None, "Producer": None, "CreationDate": None}
        for backend, suffix, metadata in (
            (FigureCanvasSVG, "svg", {"Date": None, "Creator": None}),
            (FigureCanvasPdf, "pdf", without),
        ):
            buffer = io.BytesIO()
            with mpl.rc_context(_FONTS):
                backend(canvas).print_figure(buffer, format=suffix, metadata=metadata)
            self.made[f"{name}.{suffix}"] = buffer.getvalue()

    def table(self, name: str, head: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        """Keep a table as ``name``.csv, every digit, and as ``name``.tex, rounded, for LaTeX's booktabs."""
        self.made[f"{name}.csv"] = _text(rows, head)
        align = "l" + "r" * (len(head) - 1)
        lines = [" & ".join(number(cell).translate(_LATEX) for cell in row) + r" \\" for row in (head, *rows)]
        top = [rf"\begin{{tabular}}{{{align}}}", r"\toprule", lines[0], r"\midrule"]
        self.made[f"{name}.tex"] = "\n".join([*top, *lines[1:], r"\bottomrule", r"\end{tabular}", ""]).encode()

    def metrics(self, name: str, metrics: Mapping[str, Any]) -> None:
        """Keep the metrics of one stage as a table."""
        rows = [(*label_and_unit(metric), value) for metric, value in metrics.items()]
        self.table(f"{name}-metrics", ("metric", "unit", "value"), rows)


class _Row(NamedTuple):
    panel: int
    x_label: str
    y_label: str
    series: str
    x: float
    y: float
    value: float | str = ""


def _rows(canvas: Canvas) -> Iterator[_Row]:
    """Yield what every panel draws, in its own coordinates: lines, points, bars; images and meshes with their
    values.
    """
    for panel, axes in enumerate(canvas.axes, 1):
        labels = (panel, axes.get_xlabel(), axes.get_ylabel())
        for series, points in _series(axes):
            yield from (_Row(*labels, series, float(x), float(y)) for x, y in points if np.isfinite([x, y]).all())
        for series, points, values in _fields(axes):
            found = zip(points, values, strict=True)
            yield from (_Row(*labels, series, float(x), float(y), float(v)) for (x, y), v in found if np.isfinite(v))


def _series(axes: Any) -> Iterator[tuple[str, Any]]:
    for line in axes.lines:
        points = np.column_stack([np.asarray(one, dtype=float) for one in line.get_data()])
        if line.get_transform().contains_branch(axes.transData):
            yield _name(line), points
    for collection in axes.collections:
        if isinstance(collection, PathCollection):
            yield _name(collection), np.ma.filled(np.ma.asarray(collection.get_offsets(), dtype=float), np.nan)
        elif not isinstance(collection, QuadMesh):
            for path in collection.get_paths():
                yield _name(collection), path.vertices
    bars = [one for one in axes.patches if isinstance(one, Rectangle)]
    if bars:
        yield "bars", [(one.get_x() + one.get_width() / 2, one.get_y() + one.get_height()) for one in bars]


def _fields(axes: Any) -> Iterator[tuple[str, Any, Any]]:
    for image in axes.images:
        values: Any = np.ma.filled(np.ma.asarray(image.get_array(), dtype=float), np.nan)
        if values.ndim != 2:  # a picture: its colours are no data
            continue
        left, right, bottom, top = image.get_extent()
        rows, columns = values.shape
        x = left + (np.arange(columns) + 0.5) * (right - left) / columns
        y = bottom + (np.arange(rows) + 0.5) * (top - bottom) / rows
        places = np.stack(np.meshgrid(x, y if image.origin == "lower" else y[::-1]), axis=-1)
        yield "image", places.reshape(-1, 2), values.ravel()
    for mesh in axes.collections:
        if isinstance(mesh, QuadMesh):
            corners: Any = mesh.get_coordinates()
            values = np.ma.filled(np.ma.asarray(mesh.get_array(), dtype=float), np.nan)
            yield "mesh", ((corners[:-1, :-1] + corners[1:, 1:]) / 2).reshape(-1, 2), values.ravel()


def _name(artist: Any) -> str:
    label = str(artist.get_label())
    return "" if label.startswith("_") else label


def _text(rows: Any, head: Sequence[str]) -> bytes:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return buffer.getvalue().encode()
