"""The figures and tables of a report as files for a paper: SVG, PDF, PNG, CSV, LaTeX; the same bytes from the same
logs.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.container import BarContainer
from matplotlib.figure import Figure as Canvas

from kendama_cli.plugins.publication.latex import latex_figure, latex_table
from kendama_cli.report.grid import Cell
from kendama_cli.report.tables import label_and_unit

_FONTS: Any = {"pdf.fonttype": 42, "svg.fonttype": "path"}  # TrueType embedded; outlines
COLUMN_MM, PAGE_MM = 88.0, 182.0
"""Widths of a figure in one column and in both, as most journals have them."""
_MM_PER_IN = 25.4
_PNG_DPI = 300
_UNNAMED = re.compile(r"_child\d+|_nolegend_|_")


class Files:
    """Receiver of a report's figures and tables; ``made`` holds the files' content by name.

    ``source`` names the runs in each figure, ``run`` in each row of a file; ``width_mm`` is that of all figures, None
    for one or both columns.
    """

    def __init__(self, source: str, run: str, width_mm: float | None = None) -> None:
        self.source, self.run = source, run
        self.made: dict[str, bytes] = {}
        self.shown: dict[str, str] = {}
        """Caption or title of each figure and table."""
        self.stage_of: dict[str, str] = {}
        """Stage in whose chapter each stands."""
        self._stage = ""
        self._width_mm = width_mm

    def chapter(self, stage: str) -> None:
        """Note that what follows is of ``stage``."""
        self._stage = stage

    def width_in(self, *, wide: bool) -> float:
        """Return the width of a figure [in]."""
        return (self._width_mm or (PAGE_MM if wide else COLUMN_MM)) / _MM_PER_IN

    def figure(self, name: str, canvas: Canvas) -> None:
        """Keep ``canvas`` as SVG, PDF and PNG, and the data in it as CSV."""
        rows = ((self.run, *row) for row in _rows(canvas))
        self.made[f"{name}.csv"] = _text(rows, ("run", *_Row._fields))
        canvas.set_layout_engine("none")  # it is laid out
        without = {"Creator": None, "Producer": None, "CreationDate": None}
        for backend, suffix, metadata in (
            (FigureCanvasSVG, "svg", {"Date": None, "Creator": None}),
            (FigureCanvasPdf, "pdf", without),
            (FigureCanvasAgg, "png", {"Software": None}),
        ):
            buffer = io.BytesIO()
            paper: dict[str, Any] = {"dpi": _PNG_DPI, "facecolor": "white"} if suffix == "png" else {}
            with mpl.rc_context(_FONTS):
                backend(canvas).print_figure(buffer, format=suffix, metadata=metadata, **paper)
            self.made[f"{name}.{suffix}"] = buffer.getvalue()

    def captions(self, by_name: Mapping[str, str]) -> None:
        """Keep each figure's caption as text and as a LaTeX figure that includes its PDF."""
        for name, caption in by_name.items():
            if f"{name}.pdf" in self.made:
                self.shown[name], self.stage_of[name] = caption, self._stage
                self.made[f"{name}.txt"] = f"{caption}\n{self.source}\n".encode()
                self.made[f"{name}.tex"] = latex_figure(name, caption).encode()

    def grid(self, name: str, title: str, head: Sequence[str], rows: Sequence[Sequence[Cell]]) -> None:
        """Keep a table of the page: as CSV with every digit and a column a setting, as LaTeX as the page shows it."""
        texts = [[f"{cell.text} ({cell.note})" if cell.note else cell.text for cell in row] for row in rows]
        self.table(name, title, *_flat_grid(head, rows), shown=(head, texts))

    def table(
        self,
        name: str,
        title: str,
        head: Sequence[str],
        rows: Sequence[Sequence[Any]],
        shown: tuple[Sequence[str], Sequence[Sequence[str]]] | None = None,
    ) -> None:
        """Keep a table as ``name``.csv, every digit, and as ``name``.tex, rounded or as ``shown``."""
        self.made[f"{name}.csv"] = _text(((self.run, *row) for row in rows), ("run", *head))
        self.made[f"{name}.tex"] = latex_table(name, title, *(shown or (head, rows))).encode()
        self.shown[name], self.stage_of[name] = title, self._stage

    def listing(self, name: str, title: str, head: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        """Keep a table that is too large for a page, as CSV alone."""
        self.made[f"{name}.csv"] = _text(rows, head)
        self.shown[name], self.stage_of[name] = title, ""

    def metrics(self, name: str, metrics: Mapping[str, Any], seed: str) -> None:
        """Keep the metrics of one stage as a table."""
        self.chapter(name)
        rows = [(seed, *label_and_unit(metric), value) for metric, value in metrics.items()]
        self.table(f"{name}-metrics", f"Metrics of {name}", ("seed", "metric", "unit", "value"), rows)


def _flat_grid(head: Sequence[str], rows: Sequence[Sequence[Cell]]) -> tuple[list[str], list[list[Any]]]:
    """Return a table's head and rows with every value and setting in a column of its own."""
    columns: dict[tuple[int, str], str] = {}
    named = [next((list(row[place].settings) for row in rows if row[place].settings), []) for place in range(len(head))]
    cells: list[dict[tuple[int, str], Any]] = []
    for row in rows:
        made: dict[tuple[int, str], Any] = {}
        for place, (title, cell) in enumerate(zip(head, row, strict=True)):
            if named[place]:
                settings = cell.settings or {named[place][0]: cell.text}
                made |= {(place, key): value for key, value in settings.items()} | {(place, "note"): cell.note}
                columns |= {(place, key): key for key in (*settings, "note")}
                continue
            for end, value in (cell.values or {"": cell.text}).items():
                key = (place, f"\n{end}")
                made[key] = value
                columns[key] = f"{title} {end}".strip() if end.startswith("[") else f"{title}, {end}" if end else title
        cells.append(made)
    used = [key for key in columns if key[1] != "note" or any(one.get(key) for one in cells)]
    order = sorted(used, key=lambda key: key[0])
    return [columns[key] or "group" for key in order], [[one.get(key) for key in order] for one in cells]


class _Row(NamedTuple):
    panel: int | str
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
    shown = (axes for axes in canvas.axes if axes.get_label() != "<colorbar>")
    for panel, axes in enumerate(shown, 1):
        title = axes.get_title(loc="left") or axes.get_title() or panel
        labels = (title, _label(axes, "x"), _label(axes, "y"))
        for series, points in _series(axes):
            yield from (_Row(*labels, series, float(x), float(y)) for x, y in points if np.isfinite([x, y]).all())
        for series, points, values in _fields(axes):
            found = zip(points, values, strict=True)
            yield from (_Row(*labels, series, float(x), float(y), float(v)) for (x, y), v in found if np.isfinite(v))


def _label(axes: Any, axis: str) -> str:
    """Return the label of an axis; of one that axes share, that of the one of them that has it."""
    shared = getattr(axes, f"get_shared_{axis}_axes")().get_siblings(axes)
    labels = (str(getattr(one, f"get_{axis}label")()) for one in (axes, *shared))
    return next((label for label in labels if label), "")


def _series(axes: Any) -> Iterator[tuple[str, Any]]:
    for line in axes.lines:
        points = np.column_stack([np.asarray(one, dtype=float) for one in line.get_data()])
        if line.get_transform().contains_branch(axes.transData):
            yield _name(line, axes), points
    for collection in axes.collections:
        if isinstance(collection, PathCollection):
            yield _name(collection, axes), np.ma.filled(np.ma.asarray(collection.get_offsets(), dtype=float), np.nan)
        elif not isinstance(collection, QuadMesh):
            for path in collection.get_paths():
                yield _name(collection, axes), path.vertices
    for bars in (one for one in axes.containers if isinstance(one, BarContainer)):
        tops = [(one.get_x() + one.get_width() / 2, one.get_y() + one.get_height()) for one in bars.patches]
        yield "bars" if _UNNAMED.match(str(bars.get_label())) else str(bars.get_label()).lstrip("_"), tops


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


def _name(artist: Any, axes: Any) -> str:
    """Return the series' name; a label after an underscore is hidden from legends alone.

    A series without one is named by the axis that it is drawn along.
    """
    label = str(artist.get_label())
    if label and not _UNNAMED.fullmatch(label):
        return label.lstrip("_")
    return _label(axes, "y").partition(" [")[0] or "line"


def _text(rows: Any, head: Sequence[str]) -> bytes:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return buffer.getvalue().encode()
