"""Drawing of a run's logs up to their last checkpoints, in a thread that takes little of the machine."""

from __future__ import annotations

import dataclasses
import io
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from kendama_cli.errors import KendamaError
from kendama_cli.log.writer import McapLog
from kendama_cli.pipeline.artifact_place import LOG
from kendama_cli.pipeline.plan import Planner
from kendama_cli.plugins.watch.pages import chapters_page, last_motion, replay_page
from kendama_cli.plugins.watch.status import RunStatus, StageStatus
from kendama_cli.report.chapters import performances
from kendama_cli.report.replay.performance import Kind, Performance
from kendama_cli.report.source import StageLog
from kendama_cli.schema.declaration import StageDeclaration
from kendama_cli.store.checkpoint import CheckpointFolder

Stamp = tuple[str, ...]
"""Changes where a log has more than before."""
MAX_FRACTION = 0.1
"""Largest part of one core that drawing takes."""
LOOK_S = 1.0
_NICE = 10


def log_stamp(planner: Planner, stage: StageStatus) -> Stamp | None:
    """Return the stamp of the log of ``stage``; None if there is no log yet."""
    if stage.artifact is not None:
        return "whole", stage.artifact
    checkpoints = _checkpoints(planner, stage)
    files = checkpoints.files() if checkpoints else []
    return ("up to", str(files[-1])) if files else None


def read_log(planner: Planner, stage: StageStatus) -> StageLog | None:
    """Read the log of ``stage`` as far as it is on the disk; return None if no whole log is there just now."""
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


@dataclass
class Drawn:
    """One drawn page: its bytes, and how often it was drawn."""

    page: bytes = b""
    number: int = 0

    def renew(self, page: str) -> None:
        """Take ``page`` where it differs."""
        data = page.encode()
        if data != self.page:
            self.page, self.number = data, self.number + 1


@dataclass
class _Known:
    """Content that was read of a stage's log at ``stamp``."""

    stamp: Stamp | None = None
    motions: list[Performance] = field(default_factory=list)


class Drawing:
    """The replay and the chapters of one run, by the names ``replay`` and ``chapters``."""

    def __init__(self, status: RunStatus, planner: Planner) -> None:
        self._status, self._planner = status, planner
        self._declared: dict[str, StageDeclaration] = {spec.name: spec.declaration for spec in planner.pipeline.stages}
        self._known: dict[str, _Known] = {}
        self._shown_last: list[str] = []
        self.pages = {"replay": Drawn(), "chapters": Drawn()}
        self._over = threading.Event()

    def follow(self, is_watched: Callable[[], bool]) -> None:
        """Draw again whenever a log has more, while somebody looks on, until ``finish``."""
        if sys.platform == "linux":  # where a thread has a priority of its own
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        pause_s = LOOK_S
        while not self._over.wait(pause_s):
            began_s = time.monotonic()
            if is_watched():
                self.draw()
            pause_s = max(LOOK_S, (time.monotonic() - began_s) / MAX_FRACTION)

    def finish(self) -> None:
        """Make ``follow`` return."""
        self._over.set()

    def draw(self) -> None:
        """Draw what has changed since the last time."""
        stages = self._status.stages
        fresh = {}
        for stage in stages:
            stamp = log_stamp(self._planner, stage)
            known = self._known.setdefault(stage.name, _Known())
            if stamp is not None and stamp != known.stamp:
                log = read_log(self._planner, stage)
                if log is not None:
                    self._known[stage.name] = _Known(stamp, self._motions(stage, log))
                    fresh[stage.name] = log
        shown = self._shown(stages)
        if shown != self._shown_last or any(name in fresh for name in shown):
            self._shown_last = shown
            logs = [(one, fresh.get(one.name) or read_log(self._planner, one)) for one in stages if one.name in shown]
            found = [(one.name, self._declared[one.name], log) for one, log in logs if log is not None]
            if found:
                self.pages["chapters"].renew(chapters_page(found))
        if not fresh:
            return
        newest_first = stages[::-1]
        newest_first.sort(key=lambda stage: stage.state != "runs")
        motions = [one for stage in newest_first for one in self._known[stage.name].motions]
        if any("ball" in one.bodies.names for one in motions):
            self.pages["replay"].renew(replay_page(motions))

    def _shown(self, stages: list[StageStatus]) -> list[str]:
        """Return the stages whose chapters are shown: all that run and have a log, else the last that has ended."""
        read = [stage for stage in stages if self._known[stage.name].stamp is not None]
        running = [stage.name for stage in read if stage.state == "runs"]
        charted = [stage.name for stage in read if self._declared[stage.name].chapter is not None]
        return running or charted[-1:]

    def _motions(self, stage: StageStatus, log: StageLog) -> list[Performance]:
        declaration = self._declared[stage.name]
        if stage.artifact is not None:
            return performances(declaration, log)
        kind: Kind = "simulation" if declaration.kind == "computes" else "robot"
        motion = last_motion(log, f"{declaration.title}: the last motion", kind)
        return [] if motion is None else [motion]


def write_snapshot(part: Path, position: bytes, target: Path, *, stage: str, settings: Mapping[str, Any]) -> None:
    """Write to ``target`` the log that grows in ``part`` as it was at ``position``, which a checkpoint keeps.

    ``part`` is only read. Raises ValueError where it is not as it was then, OSError where ``target`` is refused.
    """
    log = McapLog({}, _Beginning(part))
    log.restore(position)
    log.finish(target, stage=stage, settings=settings, metrics={})


class _Beginning:
    """The first bytes of a file to which another process appends."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._size = -1  # all

    def write(self, data: bytes, /) -> None:
        raise io.UnsupportedOperation("what only looks on writes nothing")

    def cut(self, size: int) -> None:
        self._size = size

    def reader(self) -> BinaryIO:
        with self._path.open("rb") as file:
            return io.BytesIO(file.read(self._size))
