"""The video of a run: finds a motion in its logs and has it rendered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.errors import InputError
from kendama_cli.log.reader import logged_settings
from kendama_cli.pipeline.report import logs_of
from kendama_cli.plugins.publication.video_file import Progress, check_video_name, write_video
from kendama_cli.report.chapters import declaration_of, performances
from kendama_cli.report.replay.performance import Performance
from kendama_cli.report.source import StageLog
from kendama_cli.settings.game import GameSettings


def video_of_run(records: Sequence[Mapping[str, Any]], path: Path, progress: Progress | None = None) -> int:
    """Write the video of a run's first motion with an arm, or else of its first motion; how many images it has.

    Raises InputError for several runs, where no log of the one moves a ball, and for a place where no video can be.
    """
    if len(records) != 1:
        raise InputError(str(path), f"{len(records)} runs are chosen", remedy="name one run: a video shows one")
    (record,) = records
    check_video_name(path)
    found = _motions(record)
    if not found:
        raise InputError(
            f"run {record['run']}",
            "no log of it moves a cup and a ball",
            remedy="render a run of adapt, learn or transfer (kendama runs)",
        )
    motion, log = min(found, key=lambda one: one[0].links is None)
    return write_video(motion, logged_settings(GameSettings, log.settings["game"], "game", log.path), path, progress)


def _motions(record: Mapping[str, Any]) -> list[tuple[Performance, StageLog]]:
    entries = {str(stage["name"]): stage for stage in record["stages"]}
    found = []
    for name, path in logs_of(record).items():
        declaration = declaration_of(name, entries.get(name, {}))
        if declaration is None or declaration.replay is None:
            continue
        log = StageLog(path)
        if "game" in log.settings:
            found += [(one, log) for one in performances(declaration, log) if "ball" in one.bodies.names]
    return found
