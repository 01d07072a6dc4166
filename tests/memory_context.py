"""A StageContext that keeps everything in memory, for tests that run a stage alone."""

from __future__ import annotations

import copy
import zlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kendama_cli.schema.declaration import find_stage
from kendama_cli.schema.messages import codec, kind_of


class MemoryLog:
    """Collects (topic, t_s, message), each message as a reader of the log file would get it."""

    def __init__(self) -> None:
        self.messages: list[tuple[str, float, Any]] = []

    def write(self, topic: str, t_s: float, message: object) -> None:
        stage = find_stage(topic.split("/")[1])
        assert stage is not None, topic
        kind = kind_of(stage.topics, topic)
        assert type(message) is kind, f"{topic} is declared to hold {kind.__name__}"
        self.messages.append((topic, float(t_s), codec(kind).decode(codec(kind).encode(message, round(1e9 * t_s)))))


class MemoryContext:
    """Checkpoints on every call; ``stop_after`` raises KeyboardInterrupt after that many, as a kill would."""

    def __init__(
        self, seed: int = 0, *, stop_after: int | None = None, resume_from: MemoryContext | None = None
    ) -> None:
        self.seed = seed
        self.log = MemoryLog()
        self.stop_after = stop_after
        self.saved: tuple[dict[str, Any], dict[str, Any], list[Any]] | None = resume_from.saved if resume_from else None
        self.checkpoints = 0
        self.questions: list[str] = []
        self.answers: list[str] = []
        self._streams: dict[str, np.random.Generator] = {}

    def rng(self, purpose: str) -> np.random.Generator:
        if purpose not in self._streams:
            self._streams[purpose] = np.random.default_rng([self.seed, zlib.crc32(purpose.encode())])
        return self._streams[purpose]

    def restore(self) -> Mapping[str, Any] | None:
        if self.saved is None:
            return None
        state, streams = copy.deepcopy(self.saved[:2])
        for purpose, stream in streams.items():
            self.rng(purpose).bit_generator.state = stream
        self.log.messages = list(self.saved[2])
        return state

    def checkpoint(self, state: Callable[[], Mapping[str, Any]], *, force: bool = False) -> None:
        streams = {purpose: stream.bit_generator.state for purpose, stream in self._streams.items()}
        # what was logged stays as it is: only the list is copied, for all of it at every checkpoint costs minutes
        self.saved = (*copy.deepcopy((dict(state()), streams)), list(self.log.messages))
        self.checkpoints += 1
        if self.stop_after is not None and self.checkpoints >= self.stop_after:
            raise KeyboardInterrupt

    def ask(self, question: str) -> str | None:
        self.questions.append(question)
        return self.answers.pop(0) if self.answers else None

    def progress(self, done: int, total: int | None, **figures: float | int | str) -> None:
        pass
