"""Location of a home's runs: the record of each is ``runs/RUN.json``, its printed output and logs are in
``runs/RUN/``.

A run that found everything done has no folder, which would take as much of the disk as its record.
"""

from __future__ import annotations

from pathlib import Path

from kendama_cli.errors import FormatError
from kendama_cli.store import durable
from kendama_cli.store.home import RUN, check_names

_RECORD = ".json"
_BEFORE = "run.json"
"""A run's record stood in its folder under this name until 0.2."""


def record_path(home: Path, run: str) -> Path:
    """Return the file of a run's record."""
    return home / "runs" / f"{run}{_RECORD}"


def run_folder(home: Path, run: str) -> Path:
    """Return the folder beside a run's record; absent if the run has no files."""
    return home / "runs" / run


def run_number(run: str) -> int:
    """Return the number at the start of a run's name, by which runs are ordered."""
    digits = run.partition("-")[0]
    return int(digits) if digits.isascii() and digits.isdecimal() else 0


def run_names(home: Path) -> list[str]:
    """Return the runs that have a record or a folder, oldest first.

    Raises StoreError where that cannot be told now, FormatError where a record stands inside a folder, as until 0.2,
    and UsageError where the records have the names of an older version.
    """
    check_names(home)
    names = [name for name in durable.names(home / "runs") if RUN.fullmatch(name.removesuffix(_RECORD))]
    recorded = {name.removesuffix(_RECORD) for name in names if name.endswith(_RECORD)}
    others = {name for name in names if not name.endswith(_RECORD)} - recorded
    for run in others:
        if durable.exists(run_folder(home, run) / _BEFORE):
            place = str(run_folder(home, run) / _BEFORE)
            raise FormatError(place, "the record of a run", "runs/RUN/run.json", "runs/RUN.json")
    return sorted(recorded | others, key=lambda run: (run_number(run), run))
