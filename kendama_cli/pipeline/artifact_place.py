"""Where a stage's artifact and log lie, from RUN/STAGE as a person types it."""

from __future__ import annotations

from pathlib import Path

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.record import find_run, past_runs

LOG = "log.mcap"


def artifact_folder(home: Path, place: str) -> Path:
    """The folder of the artifact at ``place``: RUN/STAGE, or STAGE of the newest run that has it.

    Raises UsageError where there is no such run or stage, or where the stage gave nothing.
    """
    run, _, stage = place.rpartition("/")
    if run:
        record = find_run(home, run)
    else:
        having = [one for one in past_runs(home) if any(made["name"] == stage for made in one["stages"])]
        record = having[-1] if having else find_run(home, None)
    stages = {str(made["name"]): made for made in record["stages"]}
    if stage not in stages:
        known = ", ".join(stages) or "none"
        raise UsageError(f"run {record['run']} has no stage '{stage}'; it has {known}")
    folder = stages[stage]["artifact"]
    if folder is None or not Path(folder).is_dir():
        raise UsageError(f"stage '{stage}' of run {record['run']} has no stored artifact; 'kendama run' makes it again")
    return Path(folder)


def log_path(home: Path, place: str) -> Path:
    """A log's file: ``place`` itself where there is such a file, else the log of the artifact at RUN/STAGE."""
    path = Path(place)
    if path.exists() or path.suffix == ".mcap":
        return path
    return artifact_folder(home, place) / LOG
