"""Everything a user reads: plans, tables, errors and results as text. The only place that prints."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any, Literal

from kendama_cli.cli.fitted import hanging, table_lines, terminal_columns, wrapped

if TYPE_CHECKING:  # a run with nothing to do prints without planning
    from kendama_cli.pipeline.plan import StagePlan
    from kendama_cli.pipeline.record import RunRecord


def error(message: str) -> None:
    """Print a line on standard error, which a terminal shows in several."""
    note(f"kendama: {' '.join(message.split())}")


def note(message: str) -> None:
    """Print a line beside the result, on standard error."""
    columns = terminal_columns(sys.stderr)
    lines = [line for one in message.split("\n") for line in hanging(one, columns)]
    sys.stderr.write("\n".join(lines) + "\n")  # in one piece: other threads write lines too
    sys.stderr.flush()


def text(message: str) -> None:
    """Print a result on standard output at once, because a program may wait for it."""
    print(message, flush=True)


def document(value: Any) -> None:
    """Print a JSON document on standard output."""
    print(json.dumps(value, indent=2, ensure_ascii=False))


def documents(values: Iterable[Any]) -> None:
    """Print a JSON list on standard output, as ``document`` prints it, of values that are never held together."""
    before = "[\n"
    for value in values:
        sys.stdout.write(before + indent(json.dumps(value, indent=2, ensure_ascii=False), "  "))
        before = ",\n"
    print("[]" if before == "[\n" else "\n]")


def line(value: Any) -> None:
    """Print a JSON document in one line on standard output at once, for a program that waits for it."""
    print(json.dumps(value, ensure_ascii=False), flush=True)


def table(rows: Iterable[Sequence[str]], *, head: Sequence[str] = (), optional: Sequence[str] = ()) -> None:
    """Print rows in aligned columns on standard output, on a terminal fitted to its width.

    ``optional`` names columns that a narrow terminal does without, the least important first.
    """
    for line in table_lines(list(rows), head, width=terminal_columns(), optional=optional):
        print(line)


def prose(message: str) -> None:
    """Print a result on standard output, on a terminal in lines that end between words."""
    text("\n".join(hanging(message, terminal_columns())))


def plan(stages: Sequence[StagePlan]) -> None:
    """Print a line per stage: cached, or run with the reasons."""
    table(
        [
            (item.spec.name, "cached", "; ".join([(item.key or "")[:12], *item.reasons]))
            if item.result is not None
            else (item.spec.name, "run", "; ".join(item.reasons))
            for item in stages
        ]
    )


def plan_document(pipeline: str, overrides: Sequence[str], stages: Sequence[StagePlan]) -> dict[str, Any]:
    """Return the document that ``plan --json`` prints."""
    return {
        "pipeline": pipeline,
        "overrides": list(overrides),
        "stages": [
            {
                "name": item.spec.name,
                "key": item.key,
                "status": "run" if item.result is None else "cached",
                "reasons": list(item.reasons),
            }
            for item in stages
        ],
    }


def figure(value: Any, digits: int = 4) -> str:
    """Return a number as a person would write it."""
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "-"}[value]
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value) or "-"


def change(before: Any, after: Any) -> str:
    """Return ``before -> after`` with as many digits as tell the two apart."""
    texts = ((figure(before, digits), figure(after, digits)) for digits in range(4, 18))
    first, second = next((pair for pair in texts if pair[0] != pair[1]), (figure(before), figure(after)))
    return f"{first} -> {second}"


def figures(values: Mapping[str, Any], most: int | None = None) -> str:
    """Return ``name value`` pairs in one line, the first ``most`` of them."""
    return ", ".join(f"{name} {figure(value)}" for name, value in list(values.items())[:most])


def summary(record: RunRecord, next_step: str) -> None:
    """Print how a run ended, in a few lines: each stage by its headline metrics, what warns, and what was read.

    Why a stage failed stands among the progress lines already, where these are no live view.
    """
    failed_already = "standard error says why" if not sys.stderr.isatty() else None
    for stage in record.stages:
        shown = {name: value for name, value in stage.metrics.items() if name != "warnings"}
        reason = stage.error and (failed_already or stage.error)
        _closing(f"{stage.name:<9} {stage.status:<6} ", reason or figures(shown, 6), COLOURS.get(stage.status, ""))
    for stage in record.stages:
        for warning in (stage.metrics.get("warnings") or "").splitlines():
            _closing(f"{stage.name:<9} warns  ", warning, COLOURS["warns"])
    for stage in (one for one in record.stages if one.status == "ran"):
        if words := declared_words(stage.stage, "again", {**stage.metrics, "run": record.run, "stage": stage.name}):
            _closing(f"{stage.name:<9} again  ", words)
    for line in record.read:
        _closing(f"{'read':<16} ", line)
    if record.is_recorded:
        _closing(f"{'results':<16} ", f"in {short(record.home)}")
    print(f"run {record.run} {record.outcome}; {next_step}")


def declared_words(stage: str, which: Literal["brief", "again"], values: Mapping[str, Any]) -> str | None:
    """Return the first line of these words in the declaration of ``stage`` whose ``values`` are there, with them."""
    from kendama_cli.errors import KendamaError  # noqa: PLC0415 - a run with nothing to do prints without it
    from kendama_cli.schema.declaration import find_stage  # noqa: PLC0415 - the same
    from kendama_cli.schema.units import Counted  # noqa: PLC0415 - the same

    try:
        declaration = find_stage(stage)
    except KendamaError:
        return None
    for line in () if declaration is None else getattr(declaration, which).splitlines():
        with contextlib.suppress(LookupError, TypeError, ValueError):  # a metric that this run does not have
            counted = {name: Counted(one) if type(one) is int else one for name, one in values.items()}
            return str(line.format_map(counted))
    return None


COLOURS = {"ran": "32", "cached": "2", "failed": "31", "warns": "33"}
"""Codes of the terminal (green, faint, red, yellow) in which the head of a closing line stands."""


def short(path: Path) -> str:
    """Return a path from the current folder on where it is below that, else whole."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


def _closing(head: str, told: str, colour: str = "") -> None:
    """Print ``told`` after ``head``, on a terminal in lines that end between words; elsewhere in one line."""
    columns = terminal_columns()
    parts = wrapped(told, max(columns - len(head), 1)) if columns else [told]
    lines = [(" " * len(head) if i else head) + part for i, part in enumerate(parts)]
    if colour and sys.stdout.isatty() and "NO_COLOR" not in os.environ:
        lines[0] = f"\x1b[{colour}m{head}\x1b[0m{lines[0][len(head) :]}"
    print("\n".join(lines))
