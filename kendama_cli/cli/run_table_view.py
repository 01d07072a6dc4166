"""Work of ``runs --table``: the metrics of runs over what differs between them, as text, Markdown, CSV or JSON."""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kendama_cli.cli import render
from kendama_cli.errors import UsageError
from kendama_cli.report.chapters import declaration_of
from kendama_cli.report.run_table import Estimate, RunFacts, RunTable, run_table
from kendama_cli.schema.hints import nearest

DIGITS = 4


@dataclass(frozen=True)
class TableForm:
    """Form of a table: ``text``, ``md``, ``csv`` or ``json``, and its significant digits (None: four; a file: all)."""

    kind: str
    digits: int | None = None


def show_run_table(records: Sequence[Mapping[str, Any]], metrics: Sequence[str], form: TableForm) -> None:
    """Print a row for all runs whose overrides are equal but for the seed; by default of the headline metrics.

    Raises UsageError for a metric that no run has.
    """
    facts = [RunFacts.of(record) for record in records]
    known = list(dict.fromkeys(name for one in facts for name in one.metrics))
    for name in metrics:
        if name not in known:
            raise UsageError(
                f"--columns {name}: no metric of these runs{nearest(name, known)}; 'kendama runs' shows other columns"
            )
    table = run_table(facts, metrics or _headlines(records, known))
    failed = [record for record in records if record["outcome"] != "done"]
    if failed:
        ended = ", ".join(f"{one['run']} {one['outcome']}" for one in failed)
        render.note(f"{len(failed)} of {len(records)} runs did not end well: {ended}")
    if form.kind == "json":
        render.document(_document(table))
    elif form.kind == "csv":
        csv.writer(sys.stdout, lineterminator="\n").writerows(_cells(table, form.digits))
    else:
        head, *rows = _texts(table, form.digits or DIGITS)
        if form.kind == "md":
            lines = [head, ["---"] * len(head), *rows]
            render.text("\n".join(f"| {' | '.join(one.replace('|', chr(92) + '|') for one in row)} |" for row in lines))
        else:
            render.table(rows, head=head)
            render.text("Median and mean [95 % intervals] over the runs of a row; a shared result counts once.")


def _headlines(records: Sequence[Mapping[str, Any]], known: Sequence[str]) -> list[str]:
    """Return the headline metrics of the runs' stages; without any, the metrics of the last stage."""
    entries = {str(stage["name"]): stage for record in records for stage in record["stages"]}
    found = []
    for name, entry in entries.items():
        declaration = declaration_of(name, entry)
        found += [f"{name}.{one.metric}" for one in (declaration.headline if declaration else ())]
    last = next(reversed(entries), "")
    return [one for one in found if one in known] or [one for one in known if one.startswith(f"{last}.")]


def _texts(table: RunTable, digits: int) -> list[list[str]]:
    rows = [[*table.settings, "runs", *table.metrics]]
    for row in table.rows:
        cells = ["" if one is None else one.texts(digits) for one in row.estimates]
        rows.append([*row.settings, str(len(row.runs)), *cells])
    return rows


def _cells(table: RunTable, digits: int | None) -> list[list[Any]]:
    ends = [f"{mean}{end}" for mean in ("", "_mean") for end in ("", "_low", "_high")]
    metrics = [f"{name}{end}" for name in table.metrics for end in ends]
    rows: list[list[Any]] = [[*table.settings, "seeds", "runs", *metrics]]
    for row in table.rows:
        cells: list[Any] = []
        for one in row.estimates:
            numbers = [*_numbers(one), *_numbers(one and one.mean)]
            cells += [None if x is None else x if digits is None else float(f"{x:.{digits}g}") for x in numbers]
        rows.append([*row.settings, " ".join(row.seeds), len(row.runs), *cells])
    return rows


def _document(table: RunTable) -> list[dict[str, Any]]:
    return [
        {
            "settings": dict(zip(table.settings, row.settings, strict=True)),
            "runs": list(row.runs),
            "seeds": list(row.seeds),
            "metrics": {
                name: one and {**_named(one), "mean": one.mean and _named(one.mean)}
                for name, one in zip(table.metrics, row.estimates, strict=True)
            },
        }
        for row in table.rows
    ]


def _numbers(one: Estimate | None) -> tuple[float | None, float | None, float | None]:
    return (None, None, None) if one is None else (one.value, one.low, one.high)


def _named(one: Estimate) -> dict[str, float | None]:
    return {"value": one.value, "low": one.low, "high": one.high, "n": one.n, "at_cap": one.capped}
