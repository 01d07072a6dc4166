"""HTML tables of figures: one row per group, intervals under the figures they belong to."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass

from kendama_cli.report.tables import number


@dataclass(frozen=True)
class Cell:
    """A figure as text and, smaller, what goes with it."""

    text: str
    note: str = ""


EMPTY = Cell("–")


def quantity(value: float | None, digits: int = 3, unit: str = "") -> str:
    """Return a figure with ``digits`` significant digits and its unit; an en dash for nothing."""
    if value is None or not math.isfinite(value):
        return "–"
    shown = number(round(value, digits - 1 - math.floor(math.log10(abs(value)))) if value else 0.0)
    return f"{shown} {unit}".strip()


def with_interval(value: float, low_high: tuple[float, float] | None) -> Cell:
    """Return a figure and its interval."""
    return Cell(quantity(value), "" if low_high is None else f"{quantity(low_high[0])} … {quantity(low_high[1])}")


def percent(share: float | None, note: str = "") -> Cell:
    """Return a share of one as a percentage."""
    if share is None:
        return EMPTY
    text = f"{100 * share:.1f}".removesuffix(".0")
    return Cell(f"{text} %", note)


def grid(head: Sequence[str], rows: Sequence[Sequence[Cell]], *, foot: Sequence[Cell] = ()) -> str:
    """Return the table; the first column holds the names of the rows."""
    titles = "".join(f"<th>{html.escape(title)}</th>" for title in head)
    body = "".join(f"<tr>{_cells(row)}</tr>" for row in rows)
    last = f"<tfoot><tr>{_cells(foot)}</tr></tfoot>" if foot else ""
    table = f'<table class="grid"><thead><tr>{titles}</tr></thead><tbody>{body}</tbody>{last}</table>'
    return f'<div class="wide">{table}</div>'


def _cells(row: Sequence[Cell]) -> str:
    parts = []
    for place, cell in enumerate(row):
        note = f"<small>{html.escape(cell.note)}</small>" if cell.note else ""
        tag = "th" if place == 0 else "td"
        parts.append(f"<{tag}>{html.escape(cell.text)}{note}</{tag}>")
    return "".join(parts)
