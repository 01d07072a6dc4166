"""The record of a run: its settings, outcome, time, machine and versions. Never part of a key."""

from __future__ import annotations

import contextlib
import functools
import os
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kendama_cli.errors import FormatError, ReadOnlyError, StoreError, UsageError
from kendama_cli.store import durable
from kendama_cli.store.home import STAGE, above_notice, record_path, run_folder, run_names, run_number
from kendama_cli.system.interface import system
from kendama_cli.system.processor import processor
from kendama_cli.version import __version__

CPU = "processor"
LIBRARIES = (
    "dartpy",
    "embreex",
    "hydra-core",
    "mcap",
    "numba",
    "numpy",
    "opencv-python-headless",
    "pandas",
    "protobuf",
    "scipy",
    "zstandard",
)


@dataclass(frozen=True)
class StageOutcome:
    """Outcome of one stage of a run: ``name`` is the pipeline's, ``stage`` the declaration's; ``artifact`` a folder."""

    name: str
    stage: str
    key: str | None
    status: str
    seconds: float
    artifact: str | None
    metrics: dict[str, Any]
    error: str | None = None

    def document(self) -> dict[str, Any]:
        """Return the entry of ``run --json``."""
        entry = {**vars(self), "seconds": round(self.seconds, 3)}
        return {name: value for name, value in entry.items() if name != "error" or value is not None}


@dataclass
class RunRecord:
    """One run in progress; ``save`` makes what is known so far durable."""

    home: Path
    run: str
    pipeline: str
    overrides: list[str]
    started: str
    outcome: str = "running"
    stages: list[StageOutcome] = field(default_factory=list)
    versions: dict[str, str] = field(default_factory=dict)
    read: tuple[str, ...] = ()
    """A line for each file that settings name and that was read."""
    is_recorded: bool = True
    """False where the home cannot be written: a run that has nothing to compute needs no home that can."""
    has_begun: bool = False
    cached_with: dict[str, Mapping[str, str]] = field(default_factory=dict)
    """Versions that the results of cached stages were made with."""
    sweep: str | None = None
    """Name of the sweep that the run belongs to."""

    @property
    def folder(self) -> Path:
        """Return the folder beside the record that holds its printed output and logs; absent if there are none."""
        return run_folder(self.home, self.run)

    def document(self) -> dict[str, Any]:
        """Return the document that ``run --json`` prints."""
        document: dict[str, Any] = {
            "run": self.run,
            "pipeline": self.pipeline,
            "overrides": self.overrides,
            "outcome": self.outcome,
            "stages": [stage.document() for stage in self.stages],
            "read": list(self.read),
        }
        document |= {} if self.sweep is None else {"sweep": self.sweep}
        return document if self.is_recorded else {**document, "recorded": False}

    @contextlib.contextmanager
    def going_on(self) -> Iterator[None]:
        """Lock the run's folder meanwhile: by that others distinguish a run that goes on from one that was killed."""
        with system().mark_in_use(self.folder):
            yield

    def begin(self, held: contextlib.ExitStack) -> None:
        """Write it when the first stage has to be computed, and lock its folder as long as ``held`` is open.

        A run with nothing to do is written once, at its end.
        """
        if not self.has_begun:
            held.callback(self._tidy)
            durable.make_folder(self.folder)
            held.enter_context(self.going_on())
            self.save()
            self.has_begun = True

    def end(self, outcome: str) -> None:
        """Write how it ended; in a home that cannot be written a run with nothing to do is not recorded."""
        self.outcome = outcome
        try:
            self.save()
        except ReadOnlyError:
            if self.has_begun:
                raise
            self.is_recorded = False

    def withdraw(self) -> None:
        """Delete what was written of a run that was refused before anything was computed: it is none."""
        with contextlib.suppress(OSError):
            record_path(self.home, self.run).unlink(missing_ok=True)
            for stage in self.stages:
                (self.folder / f"{stage.name}.txt").unlink(missing_ok=True)
        self.is_recorded = False

    def save(self) -> None:
        """Write the record, durably; raises StoreError where the disk refuses."""
        if not self.is_recorded:
            return
        beside = {"started": self.started, "host": _host(), "versions": self.versions, "printed": self._printed()}
        durable.write_sealed(record_path(self.home, self.run), {**self.document(), **beside})

    def _printed(self) -> dict[str, str]:
        """Return the digests of the printed output of ended stages' workers, which is on the disk then."""
        digests = {}
        for path in (self.folder / f"{stage.name}.txt" for stage in self.stages if stage.status != "cached"):
            data = durable.read_file(path)
            if data:
                with durable.plain_disk_errors(path):
                    system().sync(path)
                    system().sync(path.parent)
                digests[path.name] = durable.sha256(data)
        return digests

    def _tidy(self) -> None:
        """Delete what stages that ran did not print, and the folder where nothing else is in it."""
        with contextlib.suppress(OSError):
            for stage in self.stages:
                printed = self.folder / f"{stage.name}.txt"
                if stage.status == "ran" and printed.exists() and not printed.stat().st_size:
                    printed.unlink()
            self.folder.rmdir()


def next_number(home: Path) -> int:
    """Return the number of the next run; if a clock was set back, the run still sorts after the others."""
    return max(map(run_number, durable.names(home / "runs")), default=0) + 1


def begin(
    home: Path,
    pipeline: str,
    overrides: list[str],
    known_versions: dict[str, str] | None = None,
    *,
    number: int | None = None,
    sweep: str | None = None,
) -> RunRecord:
    """Return a new record; ids sort by ``number``, by default the next. ``known_versions`` saves a look-up."""
    run = f"{next_number(home) if number is None else number:05d}-{os.urandom(3).hex()}"
    started = time.strftime("%Y-%m-%dT%H:%M:%S+00:00", time.gmtime())
    return RunRecord(home, run, pipeline, overrides, started, versions=known_versions or versions(), sweep=sweep)


def past_runs(home: Path) -> list[dict[str, Any]]:
    """Return all readable records, oldest first, each with the ``folder`` beside it."""
    return [record for record, _ in each_run(home) if record is not None]


def each_run(home: Path) -> Iterator[tuple[dict[str, Any] | None, str]]:
    """Yield the record of every run, None where it cannot be read, and its name; oldest first, and one at a time."""
    return ((read_run(home, run), run) for run in run_names(home))


def read_run(home: Path, run: str) -> dict[str, Any] | None:
    """Return the record of a run, with the ``folder`` beside it; None if it is damaged or cannot be read now."""
    try:
        record = durable.read_sealed(record_path(home, run))
    except FormatError:
        raise
    except StoreError:  # one that cannot be read now hides no other
        return None
    if record is None or not all(STAGE.fullmatch(str(stage["name"])) for stage in record["stages"]):
        return None  # names of stages become names of files
    folder = run_folder(home, run)
    known = {**record, "folder": str(folder)}
    killed = record["outcome"] == "running" and not (folder.exists() and system().is_in_use(folder))
    return {**known, "outcome": "killed"} if killed else known


def unreadable_notice(home: Path, unreadable: int) -> str:
    """Return the notice on runs whose record cannot be read, with what to do about it."""
    return f"runs in {home} whose record cannot be read: {unreadable}; 'kendama cache verify' says which and why"


def find_run(home: Path, run: str | None) -> dict[str, Any]:
    """Return the record called ``run`` (its number or a unique prefix will do), or the newest; raises UsageError if
    none is.
    """
    if run is None:
        known = (read_run(home, name) for name in reversed(run_names(home)))  # of many runs this reads one
        newest = next(filter(None, known), None)
        if newest is not None:
            return newest
    names = run_names(home)
    matching = [name for name in names if run is not None and run.isdecimal() and run_number(name) == int(run)]
    matching = matching or [name for name in names if run is not None and name.startswith(run)]
    found = [record for record in (read_run(home, name) for name in matching) if record is not None]
    if len(found) == 1:
        return found[0]
    if run is None or not any(read_run(home, name) for name in reversed(names)):
        unreadable = sum(record_path(home, name).exists() for name in names)
        none = f"no runs in {home} yet{above_notice(home)}; 'kendama run' makes one, --home names another folder"
        raise UsageError(unreadable_notice(home, unreadable) if unreadable else none)
    from kendama_cli.schema.hints import nearest  # noqa: PLC0415 - only where there is something to say

    if found:
        raise UsageError(f"several runs begin with '{run}'; type more of one: {', '.join(matching[:5])}")
    hint = nearest(run, names) or f"; the newest is {run_number(names[-1])}, and 'kendama runs' lists all"
    raise UsageError(f"no run '{run}'{hint}")


def version_differences(made_with: Mapping[str, str], here: Mapping[str, str] | None = None) -> list[str]:
    """Return what a result was made with in another version than ``here``: ``numpy 2.3.1, here 2.4.0``.

    Of processors it says which vector extensions one has and the other has not. ``here`` is by default this process.
    """
    here = versions() if here is None else here
    differing = [
        name
        for name in sorted({*made_with, *here} - {"kendama", CPU})  # kendama's code is part of the key
        if made_with and made_with.get(name, "missing") != here.get(name, "missing")
    ]
    found = [f"{name} {made_with.get(name, 'missing')}, here {here.get(name, 'missing')}" for name in differing]
    there, ours = made_with.get(CPU, "").split(), here.get(CPU, "").split()
    if there and ours and there != ours:  # until 0.2 nobody wrote it down
        only = [[word for word in one if word not in other] for one, other in ((there, ours), (ours, there))]
        found.append(f"a processor with {' '.join(only[0]) or 'less'}, here {' '.join(only[1]) or 'less'}")
    return found


def elsewhere_notice(record: RunRecord) -> str | None:
    """Return the line that names cached results which were made with other libraries or processors; None for none."""
    stages: dict[str, list[str]] = {}
    for stage, made_with in record.cached_with.items():
        stages.setdefault("; ".join(version_differences(made_with, record.versions)), []).append(stage)
    lines = [f"{', '.join(names)} with {others}" for others, names in stages.items() if others]
    return f"cached results were made elsewhere: {'; '.join(lines)}" if lines else None


def _host() -> str:
    if hasattr(os, "uname"):
        return os.uname().nodename
    import platform  # noqa: PLC0415 - as below

    return platform.node()


def versions() -> dict[str, str]:
    """Return the versions of Python, kendama and the libraries that results depend on, and the kinds of machine and
    processor.
    """
    return dict(_versions())


@functools.cache
def _versions() -> dict[str, str]:
    """Return the package versions as they were at this process's first request; it does not run what is installed
    later.
    """
    import importlib.metadata  # noqa: PLC0415 - slow to import, and a run with nothing to do needs none of it
    import platform  # noqa: PLC0415 - as above

    found = {"python": sys.version.partition(" ")[0], "kendama": __version__}
    found["machine"] = platform.machine()
    found[CPU] = processor()
    for name in LIBRARIES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "missing"
    return found
