"""What the logs of a run that goes on have by now: of stages that ended whole, of running ones up to a checkpoint."""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path

from kendama_cli.errors import KendamaError
from kendama_cli.log.snapshot import write_snapshot
from kendama_cli.pipeline.artifact_place import LOG
from kendama_cli.pipeline.live.status import StageStatus
from kendama_cli.pipeline.plan import Planner
from kendama_cli.report.source import StageLog
from kendama_cli.store.checkpoint import CheckpointFolder

Stamp = tuple[str, ...]
"""Changes where a log has more than before."""


def log_stamp(planner: Planner, stage: StageStatus) -> Stamp | None:
    """What the log of ``stage`` is as of; None where there is none yet."""
    if stage.artifact is not None:
        return "whole", stage.artifact
    checkpoints = _checkpoints(planner, stage)
    files = checkpoints.files() if checkpoints else []
    return ("up to", str(files[-1])) if files else None


def read_log(planner: Planner, stage: StageStatus) -> StageLog | None:
    """The log of ``stage`` as far as it is on the disk; None where nothing whole is there just now."""
    try:
        if stage.artifact is not None:
            return StageLog(Path(stage.artifact) / LOG)
        return _so_far(planner, stage)
    except (KendamaError, OSError, ValueError):  # it went on, ended or was thrown away meanwhile
        return None


def _so_far(planner: Planner, stage: StageStatus) -> StageLog | None:
    checkpoints = _checkpoints(planner, stage)
    newest = next(checkpoints.intact(), None) if checkpoints else None
    if checkpoints is None or newest is None:
        return None
    settings = {own: dataclasses.asdict(value) for own, value in planner.settings[stage.name].items()}
    with tempfile.TemporaryDirectory(prefix="kendama-") as folder:
        path = Path(folder) / LOG
        write_snapshot(checkpoints.log_path, newest.log, path, stage=stage.name, settings=settings)
        return StageLog(path)


def _checkpoints(planner: Planner, stage: StageStatus) -> CheckpointFolder | None:
    if stage.state != "runs" or stage.key is None:
        return None
    return CheckpointFolder(planner.store.checkpoint_folder(stage.name, stage.key))
