"""Location of a stage's artifact and log, from RUN/STAGE as a person types it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.record import find_run, past_runs
from kendama_cli.schema.hints import listed, nearest

LOG = "log.mcap"


def artifact_folder(home: Path, location: str) -> Path:
    """Return the folder of the artifact at ``location``: RUN/STAGE, or STAGE of the newest run that has it.

    Raises UsageError where there is no such run or stage, or where the stage has no artifact.
    """
    return stored_folder(*_found(home, location))


def _found(home: Path, location: str) -> tuple[Mapping[str, Any], str]:
    run, _, stage = location.rpartition("/")
    if run:
        return find_run(home, run), stage
    having = [one for one in past_runs(home) if any(made["name"] == stage for made in one["stages"])]
    return having[-1] if having else find_run(home, None), stage


def recorded_stage(record: Mapping[str, Any], stage: str) -> Mapping[str, Any]:
    """Return the entry of ``stage`` in ``record``; raises UsageError if the run has no such stage."""
    stages: dict[str, Mapping[str, Any]] = {str(made["name"]): made for made in record["stages"]}
    if stage not in stages:
        problem = f"run {record['run']} has no stage '{stage}'"
        raise UsageError(listed(problem, nearest(stage, stages), stages, "it has"))
    return stages[stage]


def stored_folder(record: Mapping[str, Any], stage: str) -> Path:
    """Return the folder of the artifact of ``stage``; raises UsageError if it was never stored or is no longer."""
    made = recorded_stage(record, stage)
    if made["artifact"] is None or not Path(made["artifact"]).is_dir():
        raise UsageError(
            f"stage '{stage}' of run {record['run']} ({made['status']}) has no stored artifact; "
            "'kendama run' makes it again"
        )
    return Path(made["artifact"])


def stored_log(record: Mapping[str, Any], stage: str) -> Path:
    """Return the log of ``stage``; if a stage that moves or records failed, return the log up to the failure.

    Raises UsageError where there is none.
    """
    broken = broken_off_log(Path(record["folder"]), stage)
    if recorded_stage(record, stage)["status"] == "failed" and broken.exists():
        return broken
    return stored_folder(record, stage) / LOG


def broken_off_log(run_folder: Path, stage: str) -> Path:
    """Return the location of the log of a stage that failed, beside the run."""
    return run_folder / f"{stage}.mcap"


def log_path(home: Path, location: str) -> Path:
    """Return a log's file: ``location`` itself if it is such a file, else the log at RUN/STAGE."""
    path = Path(location)
    if path.exists() or path.suffix == ".mcap":
        return path
    return stored_log(*_found(home, location))
