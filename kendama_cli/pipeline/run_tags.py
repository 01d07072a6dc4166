"""Tags and a note that a person puts on a past run; they stand beside its record and change nothing of it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from kendama_cli.errors import UsageError
from kendama_cli.store import durable
from kendama_cli.store.home import run_folder

_TAG = re.compile(r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")


@dataclass(frozen=True)
class RunTags:
    """Tags and note that a user wrote on a run."""

    tags: tuple[str, ...] = ()
    note: str = ""


def read_tags(home: Path, run: str) -> RunTags:
    """Read the tags and note of ``run``; empty if there are none."""
    record = durable.read_sealed(_path(home, run))
    return RunTags() if record is None else RunTags(tuple(record["tags"]), str(record["note"]))


def write_tags(home: Path, run: str, add: Sequence[str], remove: Sequence[str], note: str | None) -> RunTags:
    """Add and remove tags, and set the note where one is given; returns what then stands.

    Raises UsageError for a tag that is none, and for one to remove that the run does not have.
    """
    for tag in add:
        if not _TAG.match(tag):
            raise UsageError(f"tag '{tag}': letters, digits, '_', '-' and '.' are allowed, 64 at most")
    before = read_tags(home, run)
    missing = [tag for tag in remove if tag not in before.tags]
    if missing:
        raise UsageError(f"run {run} has no tag '{missing[0]}'; it has {', '.join(before.tags) or 'none'}")
    kept = [tag for tag in (*before.tags, *add) if tag not in remove]
    made = RunTags(tuple(dict.fromkeys(kept)), before.note if note is None else note)
    durable.write_sealed(_path(home, run), {"tags": list(made.tags), "note": made.note})
    return made


def _path(home: Path, run: str) -> Path:
    return run_folder(home, run) / "tags.json"
