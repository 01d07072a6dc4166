"""Selection of past runs by what a person types: ids, ranges of numbers, sweeps, and ``last``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.record import each_run, find_run, read_run
from kendama_cli.schema.hints import nearest
from kendama_cli.store.home import run_names, run_number

LAST = "last"
SWEEP = "sweep:"
FORMS = f"an id or number, a range 1..40, {SWEEP}NAME, or {LAST}"
"""The words a selection is made of, as helps show them."""
_RANGE = re.compile(r"(\d{1,18})\.\.(\d{1,18})")
_NAME = re.compile(r"(?=.*[A-Za-z])[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")

Record = Mapping[str, Any]


def select_runs(home: Path, texts: Sequence[str]) -> list[dict[str, Any]]:
    """Return the records that ``texts`` name, each once and in their order; the newest run where there are none.

    A range takes the runs that are there. A sweep is the newest run of each of its combinations, so a repeated sweep
    counts each once; ``last`` is the newest sweep if the newest run belongs to one, else the newest run.

    Raises UsageError where a text names no run.
    """
    selected = [record for text in texts for record in _selected(home, text)] if texts else [find_run(home, None)]
    return list({str(record["run"]): record for record in selected}.values())


def sweep_names(home: Path) -> list[str]:
    """Return the names of all sweeps in ``home``, oldest first."""
    return list(dict.fromkeys(str(record["sweep"]) for record, _ in each_run(home) if record and record.get("sweep")))


def named_sweep(home: Path, name: str | None, overrides: Sequence[str], varying: Sequence[str], day: str) -> str:
    """Return the name of a new sweep: ``name``, else the ``day`` and the last words of the ``varying`` keys.

    A name that was made up gets a number where an earlier sweep has it; a name that was typed adds to that sweep.
    Raises UsageError for a name that is none.
    """
    if name is not None:
        if name == LAST or not _NAME.fullmatch(name):
            raise UsageError(
                f"--name {name}: letters, digits, '_', '-' and '.', 64 at most, not '{LAST}' and no number; "
                "for example --name lr-study"
            )
        return name
    words = [re.sub(r"\W+", "-", key.lstrip("+~").replace("/", ".").rpartition(".")[2]) for key in varying]
    made = "-".join([day, *(words or [f"{len(overrides)}-overrides"] if overrides else ["one"])])[:56].rstrip("-_.")
    known = sweep_names(home)
    return next(one for one in (made, *(f"{made}-n{k}" for k in range(2, len(known) + 3))) if one not in known)


def _selected(home: Path, text: str) -> list[dict[str, Any]]:
    if text.startswith(SWEEP):
        return _sweep(home, text.removeprefix(SWEEP))
    if text == LAST:
        newest = find_run(home, None)
        return _sweep(home, str(newest["sweep"])) if newest.get("sweep") else [newest]
    if bounds := _RANGE.fullmatch(text):
        return _between(home, int(bounds[1]), int(bounds[2]))
    return [find_run(home, text)]


def _sweep(home: Path, name: str) -> list[dict[str, Any]]:
    newest: dict[tuple[str, ...], dict[str, Any]] = {}
    names: list[str] = []
    for record, _ in each_run(home):
        if record is not None and record.get("sweep"):
            names.append(str(record["sweep"]))
            if names[-1] == name:
                newest[str(record["pipeline"]), *map(str, record["overrides"])] = record
    if not newest:
        known = list(dict.fromkeys(names))
        there = f"there are {', '.join(known[-5:])}" if known else "no run here belongs to one"
        raise UsageError(f"no sweep '{name}' in {home}; {there}{nearest(name, known)}")
    return list(newest.values())


def _between(home: Path, first: int, last: int) -> list[dict[str, Any]]:
    if first > last:
        raise UsageError(f"{first}..{last}: the range is empty; type {last}..{first}")
    names = run_names(home)
    found = [one for run in names if first <= run_number(run) <= last and (one := read_run(home, run)) is not None]
    if not found:
        numbers = [run_number(run) for run in names]
        there = f"runs {min(numbers)}..{max(numbers)} are there" if numbers else "no runs yet"
        raise UsageError(f"{first}..{last}: no run in {home} has such a number; {there}")
    return found
