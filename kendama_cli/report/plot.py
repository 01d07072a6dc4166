"""Plots as inline SVG: one style, the page's colours, the same bytes in every process."""

from __future__ import annotations

import html
import io
import re
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure as Canvas
from matplotlib.layout_engine import ConstrainedLayoutEngine

from kendama_cli.report.figure import Panel
from kendama_cli.report.receiver import receiving
from kendama_cli.report.style import INK, LINE, MUTED, VARIABLES

_STYLE: dict[str, Any] = {
    "svg.fonttype": "none",
    "font.family": ["DejaVu Sans"],  # comes with matplotlib, so the layout is the same everywhere
    "font.size": 8.4,
    "axes.titlesize": "medium",
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "grid.color": LINE,
    "grid.linewidth": 0.5,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "text.color": INK,
    "lines.linewidth": 1.5,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.handlelength": 1.4,
    "legend.columnspacing": 1.3,
    "legend.borderaxespad": 0.1,
    "image.composite_image": False,
    "text.parse_math": False,  # a dollar in a label is a dollar
}

_SIZES = ("font.size", "axes.linewidth", "grid.linewidth", "lines.linewidth", "lines.markersize")
WIDE_IN = 5.5
"""Figures that the page draws wider than this take both columns in print."""
LEGEND_SHARE = 0.86
"""Of a figure's width a legend over the axes may have so much: the rest is what stands to the left of them."""
MIN_TEXT = 0.72
"""Factor below which text, and a figure's height, shrink no further in print: 6 pt."""
MAX_TEXT = 0.9
"""Factor above which text does not grow in print: 7.6 pt."""


@dataclass
class Drawing:
    """A canvas that is being drawn on, and the SVG once it is done."""

    canvas: Canvas
    name: str
    svg: str = ""

    def panel(self, title: str) -> Panel:
        """Return the finished drawing as a panel of a figure."""
        return Panel(title, self.svg, self.name)

    def axes(self, rows: int = 1, *, share_x: bool = False) -> list[Axes]:
        """Return ``rows`` axes under one another."""
        grid = self.canvas.subplots(rows, 1, sharex=share_x, squeeze=False)
        return [row[0] for row in grid]


@contextmanager
def drawing(name: str, alternative: str, *, height_in: float = 3.0, width_in: float = 4.7) -> Iterator[Drawing]:
    """Draw on ``drawing.canvas`` inside the block; afterwards ``drawing.svg`` holds the inline SVG.

    ``name`` must be unique on the page: it salts and prefixes every id. ``alternative`` is read to those who cannot
    see the figure.
    """
    receiver = receiving()
    scale = 1.0 if receiver is None else receiver.width_in(wide=width_in > WIDE_IN) / width_in
    tall = max(scale, MIN_TEXT)
    text = 1.0 if receiver is None else min(tall, MAX_TEXT)
    with mpl.rc_context():
        mpl.rcdefaults()
        parameters: Any = mpl.rcParams
        parameters.update({**_STYLE, "svg.hashsalt": name})
        parameters.update({size: text * parameters[size] for size in _SIZES})
        canvas = Canvas(
            figsize=(scale * width_in, tall * height_in), layout=ConstrainedLayoutEngine(w_pad=0.03, h_pad=0.03)
        )
        made = Drawing(canvas, name)
        yield made
        if receiver is not None:
            _explain(canvas, receiver.source)
        made.svg = _svg(canvas, name, alternative)
        if receiver is not None:
            receiver.figure(name, canvas)


def columns_of(width_in: float, columns: int) -> int:
    """Return how many of ``columns`` small axes a drawing of ``width_in`` on the page can hold side by side."""
    receiver = receiving()
    return columns if receiver is None or receiver.width_in(wide=width_in > WIDE_IN) > WIDE_IN else min(2, columns)


def _explain(canvas: Canvas, source: str) -> None:
    """Add what a figure needs to stand alone: a legend where series have names, and the runs that it shows."""
    for axes in canvas.axes:
        labels = axes.get_legend_handles_labels()[1]
        if len(labels) > 1 and axes.get_legend() is None and not canvas.legends:
            legend_above(axes)
    line = textwrap.shorten(source, int(26 * canvas.get_figwidth()), placeholder=" …")
    canvas.supxlabel(line, x=0.01, ha="left", fontsize=5.0, color=MUTED)


def legend_above(axes: Axes, columns: int = 3) -> None:
    """Draw a legend over the axes, at their left, in at most ``columns`` columns: fewer where the figure has
    less room.
    """
    room = LEGEND_SHARE * axes.figure.bbox.width
    for fewer in range(columns, 0, -1):
        legend = axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=fewer)
        if legend.get_window_extent().width <= room:
            return


def _svg(canvas: Canvas, name: str, alternative: str) -> str:
    """Return the canvas as an SVG element without header, metadata or fixed size, in the page's colours."""
    buffer = io.StringIO()
    backend: Any = FigureCanvasSVG(canvas)
    backend.print_svg(buffer, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    box = re.search(r'viewBox="([^"]*)"', text)
    assert box is not None
    head = f'<svg class="plot" role="img" aria-label="{html.escape(alternative)}" viewBox="{box[1]}"'
    text = re.sub(r"<svg[^>]*>", lambda _: f'{head} xmlns:xlink="http://www.w3.org/1999/xlink">', text, count=1)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'(href="|url\()#', rf"\g<1>#{name}-", text)
    # only inside tags: what stands between them is text for the reader
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"-?\d+\.\d{3,}", _two_decimals, tag[0]), text)
    text = re.sub(r"font: [\d.]+px[^;\"]*", lambda font: font[0].split("'")[0] + "sans-serif", text)
    for colour, variable in VARIABLES.items():
        text = text.replace(colour, f"var({variable})")
    return re.sub(r"\n\s*", "\n", text).strip()


def _two_decimals(number: re.Match[str]) -> str:
    return f"{float(number[0]):.2f}".rstrip("0").rstrip(".")
