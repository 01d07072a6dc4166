"""Metrics and settings as HTML tables: names, units and numbers as a reader expects them."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

_UNITS = (
    ("_kg_m3", "kg/m³"),
    ("_m_s2", "m/s²"),
    ("_m_s", "m/s"),
    ("_rad_s", "rad/s"),
    ("_mm", "mm"),
    ("_ms", "ms"),
    ("_hz", "Hz"),
    ("_px", "px"),
    ("_rad", "rad"),
    ("_deg", "°"),
    ("_nm", "N m"),
    ("_n", "N"),
    ("_kg", "kg"),
    ("_m", "m"),
    ("_s", "s"),
)
_TAILS = {
    "_p50": ", median",
    "_p90": ", 90 %",
    "_p95": ", 95 %",
    "_p99": ", 99 %",
    "_before": " before",
    "_after": " after",
}

_FEW = 4
"""So many values of one setting are told where runs differ in it."""


def label_and_unit(name: str) -> tuple[str, str]:
    """Split ``position_error_mm_p50`` into (``position error, median``, ``mm``)."""
    tail = ""
    for suffix, words in _TAILS.items():
        if name.endswith(suffix):
            name, tail = name.removesuffix(suffix), words
    for suffix, unit in _UNITS:
        if name.endswith(suffix) and name != suffix[1:] and not name.startswith("n_"):
            return name.removesuffix(suffix).replace("_", " ") + tail, unit
    words = name.replace("_", " ")
    return (f"number of {words[2:]}" if name.startswith("n_") else words) + tail, ""


def number(value: Any) -> str:
    """Return a value as text: yes and no, four significant digits, an en dash for nothing."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        text = f"{value:.4g}"
        return (str(round(value)) if "e+" in text and abs(value) < 1e9 else text).replace("-", "−")
    if isinstance(value, list):
        return ", ".join(map(number, value)) if value else "–"
    return str(value)


def metrics_table(metrics: Mapping[str, Any], meanings: Mapping[str, str] | None = None) -> str:
    """Return name, value and unit of every metric; its meaning shows where the pointer rests."""
    rows = []
    for name, value in metrics.items():
        label, unit = label_and_unit(name)
        shown = html.escape(f"{number(value)} {unit}".strip() if value is not None else number(value))
        told = ": ".join(filter(None, (name, (meanings or {}).get(name))))
        rows.append(f'<div><dt title="{html.escape(told)}">{html.escape(label)}</dt><dd>{shown}</dd></div>')
    return f'<dl class="facts">{"".join(rows)}</dl>' if rows else ""


def settings_table(*settings: Mapping[str, Any]) -> str:
    """Return every setting by its dotted name, folded away; of several runs the values that each has of it."""
    flat = [dict(_flat(one, "")) for one in settings]
    names = dict.fromkeys(name for one in flat for name in one)
    told = {name: _values([number(one.get(name)) for one in flat]) for name in names}
    rows = [f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(values)}</dd></div>" for name, values in told.items()]
    if not rows:
        return ""
    return f'<details><summary>Settings ({len(rows)})</summary><dl class="settings">{"".join(rows)}</dl></details>'


def _values(of_runs: Sequence[str]) -> str:
    distinct = list(dict.fromkeys(of_runs))
    return " | ".join(distinct) if len(distinct) <= _FEW else f"{len(distinct)} different ones"


def _flat(settings: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
