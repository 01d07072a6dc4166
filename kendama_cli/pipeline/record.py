"""The record of a run: what was asked, what came of it, when, where and with which versions. Never part of a key."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kendama_cli
from kendama_cli.errors import StoreError, UsageError
from kendama_cli.store import durable
from kendama_cli.system.choice import system

LIBRARIES = ("dartpy", "numpy", "scipy", "opencv-python-headless", "pandas", "mcap", "hydra-core")


@dataclass(frozen=True)
class StageOutcome:
    """How one stage of a run ended: ``name`` is the pipeline's, ``stage`` the declaration's; ``artifact`` a folder."""

    name: str
    stage: str
    key: str | None
    status: str
    seconds: float
    artifact: str | None
    metrics: dict[str, Any]
    error: str | None = None

    def document(self) -> dict[str, Any]:
        """The entry of ``run --json``."""
        entry = {
            "name": self.name,
            "stage": self.stage,
            "key": self.key,
            "status": self.status,
            "seconds": round(self.seconds, 3),
            "artifact": self.artifact,
            "metrics": self.metrics,
        }
        return entry if self.error is None else {**entry, "error": self.error}


@dataclass
class RunRecord:
    """One run while it goes on; ``save`` makes what is known so far durable."""

    home: Path
    run: str
    pipeline: str
    overrides: list[str]
    started: str
    outcome: str = "running"
    stages: list[StageOutcome] = field(default_factory=list)
    versions: dict[str, str] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """The run's own folder."""
        return self.home / "runs" / self.run

    def document(self) -> dict[str, Any]:
        """The document that ``run --json`` prints."""
        return {
            "run": self.run,
            "pipeline": self.pipeline,
            "overrides": self.overrides,
            "outcome": self.outcome,
            "stages": [stage.document() for stage in self.stages],
        }

    @contextlib.contextmanager
    def going_on(self) -> Iterator[None]:
        """Lock the run's folder meanwhile: by that others distinguish a run that goes on from one that was killed."""
        with system().mark_in_use(self.folder):
            yield

    def save(self) -> None:
        """Write the record, durably."""
        beside = {"started": self.started, "host": _host(), "versions": self.versions}
        durable.write_sealed(self.folder / "run.json", {**self.document(), **beside})


def begin(home: Path, pipeline: str, overrides: list[str], known_versions: dict[str, str] | None = None) -> RunRecord:
    """A new record; ids sort by time. ``known_versions`` spares looking up what is installed."""
    now = time.gmtime()
    run = f"{time.strftime('%Y%m%d-%H%M%S', now)}-{os.urandom(3).hex()}"
    started = time.strftime("%Y-%m-%dT%H:%M:%S+00:00", now)
    return RunRecord(home, run, pipeline, overrides, started, versions=known_versions or versions())


def past_runs(home: Path) -> list[dict[str, Any]]:
    """All readable records, oldest first."""
    found = []
    for path in sorted((home / "runs").glob("*/run.json")):
        record = None
        with contextlib.suppress(StoreError):  # one that cannot be read now hides no other
            record = durable.read_sealed(path)
        if record is not None:
            killed = record["outcome"] == "running" and not system().is_in_use(path.parent)
            found.append({**record, "outcome": "killed"} if killed else record)
    return found


def find_run(home: Path, run: str | None) -> dict[str, Any]:
    """The record called ``run`` (a unique beginning will do), or the newest; raises UsageError for none."""
    records = past_runs(home)
    if not records:
        raise UsageError(f"no runs in {home} yet; 'kendama run' makes one, --home names another folder")
    if run is None:
        return records[-1]
    matching = [record for record in records if str(record["run"]).startswith(run)]
    if len(matching) != 1:
        from kendama_cli.schema.settings import nearest  # noqa: PLC0415 - only where there is something to say

        names = [str(record["run"]) for record in records]
        problem = "no run" if not matching else "several runs begin with"
        raise UsageError(f"{problem} '{run}'; 'kendama runs' lists them{nearest(run, names)}")
    return matching[0]


def _host() -> str:
    if hasattr(os, "uname"):
        return os.uname().nodename
    import platform  # noqa: PLC0415 - as below

    return platform.node()


def versions() -> dict[str, str]:
    """Versions of Python, kendama and the libraries that results depend on."""
    import importlib.metadata  # noqa: PLC0415 - slow to import, and a run with nothing to do needs none of it

    found = {"python": sys.version.partition(" ")[0], "kendama": kendama_cli.__version__}
    for name in LIBRARIES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "missing"
    return found
