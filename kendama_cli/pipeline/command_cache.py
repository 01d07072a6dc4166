"""A run with nothing to do, without planning it: the same command line, where no file that it depends on has changed.

After a run every file and folder that decided its outcome is stored with its size, times and inode, beside the command
line, the folder, the environment and the interpreter. Where all of that is the same next time, the outcome is too, and
only the stored artifacts are read, byte by byte as ever. Any doubt leads to the full path. This module is what the
quick path imports: nothing that parses command lines or configuration; ``watched`` collects what it compares.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.errors import ReadOnlyError
from kendama_cli.pipeline.record import CPU, RunRecord, StageOutcome, begin
from kendama_cli.store import durable
from kendama_cli.store.home import keep_latest
from kendama_cli.store.store import Store
from kendama_cli.system.processor import processor
from kendama_cli.version import __version__

SETTLED_S = 2.0
"""A file changed more recently than this before the command began could have changed within one tick of its stamp."""

Stamps = dict[str, list[int]]
"""Size, times of modification and change [ns] and inode by path; an empty list where there is nothing."""


def stamp(path: str | Path) -> list[int]:
    """Return the state of ``path``; the time of change reveals even a write that restored the time of modification."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return []
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]


def stamps(paths: Iterable[str | Path]) -> Stamps:
    """Return the state of each of ``paths``."""
    return {str(path): stamp(path) for path in paths}


def settled(states: Stamps, at_s: float) -> bool:
    """Return True if none of ``states`` is so recent that its file may have changed again unnoticed before ``at_s``."""
    youngest_ns = max((max(state[1:3]) for state in states.values() if state), default=0)
    return youngest_ns / 1e9 <= at_s - SETTLED_S


def environment_now(names: Iterable[str]) -> dict[str, str | None]:
    """Return the values of the environment variables ``names``; None for each that is not set."""
    return {name: os.environ.get(name) for name in names}


@dataclasses.dataclass(frozen=True)
class CommandKey:
    """Key of a repeated command: the command line, and all but files that its meaning depends on."""

    arguments: list[str]
    folder: str
    environment: dict[str, str]
    python: list[str]

    def path(self) -> Path:
        """Return the file of the answer; if the home folder is guessed wrongly, it does not exist."""
        name = durable.sha256(durable.canonical_json(dataclasses.asdict(self)))[:32]
        home = Path(os.path.expanduser(self._home())).absolute()
        return home / "index" / "unchanged" / f"{name}.json"

    def _home(self) -> str:
        for option, value in zip(self.arguments, [*self.arguments[1:], ""], strict=True):
            if option == "--home" or option.startswith("--home="):
                return option.partition("=")[2] or value
        return self.environment.get("KENDAMA_HOME") or ".kendama"


def command_key(arguments: Sequence[str]) -> CommandKey:
    """Return the key of the command ``arguments``, here and now."""
    counts = ("HOME", "USERPROFILE")
    environment = {name: value for name, value in os.environ.items() if name.startswith("KENDAMA_") or name in counts}
    python = [sys.version, sys.executable, str(sys.flags), __version__, *sys.path]
    return CommandKey(list(arguments), os.getcwd(), environment, python)


def keep(
    asked: CommandKey,
    record: RunRecord,
    parts: Mapping[str, Any],
    watched: Stamps,
    *,
    read: Mapping[str, str | None],
    began_s: float,
) -> None:
    """Remember that ``asked`` has nothing to do while ``watched`` stays; not where one of these is too young.

    ``parts`` are what the key of each of the record's stages is made of, ``read`` the environment variables that the
    configuration read; ``began_s`` is when the command began.
    """
    if not settled(watched, began_s):
        return
    # an index sorts its keys, and the metrics' order is how they are printed: kept as pairs
    stages = [
        {**dataclasses.asdict(outcome), "status": "cached", "seconds": 0.0, "metrics": list(outcome.metrics.items())}
        for outcome in record.stages
    ]
    answer = {
        "command": dataclasses.asdict(asked),
        "stamps": watched,
        "read": dict(read),
        "home": str(record.home),
        "pipeline": record.pipeline,
        "overrides": record.overrides,
        "stages": stages,
        "parts": parts,
        "versions": record.versions,
        "said": list(record.read),
    }
    with contextlib.suppress(ValueError):  # a folder whose name is not UTF-8 text
        durable.write_index(asked.path(), answer)


def repeat(asked: CommandKey) -> RunRecord | None:
    """Return the finished record of a run that had nothing to do; None if that is not certain.

    Raises StoreError where the record cannot be written.
    """
    try:
        answer = durable.read_index(asked.path())
        if answer is None or answer.get("command") != dataclasses.asdict(asked):
            return None
        if environment_now(answer["read"]) != answer["read"]:
            return None
        if any(stamp(path) != state for path, state in answer["stamps"].items()):
            return None
        outcomes = [StageOutcome(**{**stage, "metrics": dict(stage["metrics"])}) for stage in answer["stages"]]
        parts = answer["parts"]
        record = begin(
            Path(answer["home"]), answer["pipeline"], answer["overrides"], {**answer["versions"], CPU: processor()}
        )
        record.read = tuple(answer["said"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    store = Store(record.home)
    with store.in_use():
        for outcome in outcomes:
            result = None if outcome.key is None else store.find(outcome.name, outcome.key)
            if result is None or (str(result.artifact), result.metrics) != (outcome.artifact, outcome.metrics):
                return None
            record.cached_with[outcome.name] = result.made_with
        for outcome in outcomes:
            keep_latest(record.home, record.pipeline, outcome.name, outcome.key, parts[outcome.name])
        record.stages = outcomes
        record.outcome = "done"
        try:
            record.save()
        except ReadOnlyError:
            record.is_recorded = False
    return record
