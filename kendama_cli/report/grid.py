"""HTML tables of figures: one row per group, intervals under the figures they belong to."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from kendama_cli.report.receiver import receiving
from kendama_cli.report.tables import number


@dataclass(frozen=True)
class Cell:
    """A figure as text and, smaller, what goes with it.

    In a file ``values`` are its columns with every digit, by what follows the column's head; ``settings`` stand in
    columns of their own.
    """

    text: str
    note: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)


EMPTY = Cell("–")


def quantity(value: float | None, digits: int = 3, unit: str = "") -> str:
    """Return a figure with ``digits`` significant digits and its unit; an en dash for nothing."""
    if value is None or not math.isfinite(value):
        return "–"
    shown = number(round(value, digits - 1 - math.floor(math.log10(abs(value)))) if value else 0.0)
    return f"{shown} {unit}".strip()


def with_interval(value: float, low_high: tuple[float, float] | None) -> Cell:
    """Return a figure and its interval."""
    note = "" if low_high is None else f"{quantity(low_high[0])} … {quantity(low_high[1])}"
    return Cell(quantity(value), note, _values(value, low_high))


def percent(
    share: float | None, note: str = "", *, between: tuple[float, float] | None = None, digits: int = 0
) -> Cell:
    """Return a share of one as a percentage; ``between`` is its interval, which takes the place of ``note``."""
    if share is None:
        return EMPTY
    text = f"{100 * share:.1f}".removesuffix(".0")
    if between is not None:
        note = f"{100 * between[0]:.{digits}f} … {100 * between[1]:.{digits}f}"
    return Cell(f"{text} %", note, {**_values(share, between), **({"note": note} if note and not between else {})})


def _values(value: float, low_high: tuple[float, float] | None) -> dict[str, float]:
    return {"": value, **({} if low_high is None else {"low": low_high[0], "high": low_high[1]})}


def grid(
    head: Sequence[str], rows: Sequence[Sequence[Cell]], *, name: str, title: str = "", foot: Sequence[Cell] = ()
) -> str:
    """Return the table under its ``title``; the first column holds the names of the rows.

    ``name`` is the file's where the report is exported.
    """
    if (receiver := receiving()) is not None:
        receiver.grid(name, title, head, [*rows, *([foot] if foot else [])])
    titles = "".join(f"<th>{html.escape(title)}</th>" for title in head)
    body = "".join(f"<tr>{_cells(row)}</tr>" for row in rows)
    last = f"<tfoot><tr>{_cells(foot)}</tr></tfoot>" if foot else ""
    table = f'<table class="grid"><thead><tr>{titles}</tr></thead><tbody>{body}</tbody>{last}</table>'
    return (f"<h3>{html.escape(title)}</h3>" if title else "") + f'<div class="wide">{table}</div>'


def _cells(row: Sequence[Cell]) -> str:
    parts = []
    for place, cell in enumerate(row):
        note = f"<small>{html.escape(cell.note)}</small>" if cell.note else ""
        tag = "th" if place == 0 else "td"
        parts.append(f"<{tag}>{html.escape(cell.text)}{note}</{tag}>")
    return "".join(parts)
