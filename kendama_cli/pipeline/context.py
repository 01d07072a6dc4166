"""Services that the worker provides to a running stage: log, random streams, checkpoints, progress."""

from __future__ import annotations

import contextlib
import json
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.log.writer import McapLog
from kendama_cli.schema.random_stream import random_stream
from kendama_cli.stages.interface import State
from kendama_cli.store.checkpoint import Checkpoint, CheckpointFolder, DurableAppendFile

CHECKPOINT_PERIOD_S = 1.0
CHECKPOINT_FRACTION = 0.01
"""Largest part of a stage's time that goes into checkpoints: on a slow disk they are made less often."""
PROGRESS_PERIOD_S = 0.1


class WorkerContext:
    """The StageContext of one computation."""

    def __init__(
        self,
        *,
        seed: int | None,
        checkpoints: CheckpointFolder,
        topics: Mapping[str, type],
        emit: Callable[[Mapping[str, Any]], None],
        attended: bool = False,
    ) -> None:
        """Open the services: ``topics`` are those of the stage's declaration, ``emit`` passes progress on.

        ``seed`` is None for a stage whose pipeline entry does not list it. ``attended``: somebody answers questions.
        """
        self._log_file = DurableAppendFile(checkpoints.log_path)
        self.log = McapLog(topics, self._log_file)
        self._seed = seed
        self._checkpoints = checkpoints
        self._emit, self._attended = emit, attended
        self._streams: dict[str, np.random.Generator] = {}
        self._due_s = time.monotonic() + CHECKPOINT_PERIOD_S
        self._emitted_s = 0.0

    def rng(self, purpose: str) -> np.random.Generator:
        """Return the random stream for ``purpose``; raises RuntimeError if the pipeline does not feed ``seed``."""
        if self._seed is None:
            raise RuntimeError("a stage that draws random numbers must list 'seed' in its pipeline's config")
        if purpose not in self._streams:
            self._streams[purpose] = random_stream(self._seed, purpose)
        return self._streams[purpose]

    def restore(self) -> State | None:
        """Return the newest intact checkpoint; set the log and every random stream back to their state at that time."""
        found = self._newest()
        if found is None:
            return None
        for purpose, state in found.streams.items():
            self.rng(purpose).bit_generator.state = state
        return found.state

    def checkpoint(self, state: Callable[[], State], *, force: bool = False) -> None:
        """Save now if the last one is old enough or ``force`` is set."""
        began_s = time.monotonic()
        if not force and began_s < self._due_s:
            return
        streams = {purpose: stream.bit_generator.state for purpose, stream in self._streams.items()}
        self._log_file.sync()  # before the checkpoint that counts on it
        self._checkpoints.save(state(), streams, self.log.position())
        now_s = time.monotonic()
        self._due_s = now_s + max(CHECKPOINT_PERIOD_S, (now_s - began_s) / CHECKPOINT_FRACTION)

    def ask(self, question: str) -> str | None:
        """Have the process that started the worker ask ``question``; its answer comes through a file."""
        if not self._attended:
            return None
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "answer.json"
            self._emit({"event": "asks", "question": question, "answer": str(path)})
            while not path.exists():
                time.sleep(PROGRESS_PERIOD_S)
            answer: str | None = json.loads(path.read_text())
            return answer

    def progress(self, done: int, total: int | None, **figures: float | int | str) -> None:
        """Pass on where the work stands, at most ten times a second."""
        now = time.monotonic()
        if done == total or now - self._emitted_s >= PROGRESS_PERIOD_S:
            self._emitted_s = now
            self._emit({"event": "progress", "done": done, "total": total, "figures": figures})

    def close(self) -> None:
        """Let go of the log's file, and of the folder where no checkpoint needs it."""
        self._log_file.close()
        self._checkpoints.discard_unless_saved()

    def _newest(self) -> Checkpoint | None:
        """Restore and return the newest checkpoint that is intact and whose log is intact."""
        for found in self._checkpoints.intact():
            with contextlib.suppress(ValueError):  # the log lost what this one counts on: an older one counts on less
                self.log.restore(found.log)
                return found
        return None
