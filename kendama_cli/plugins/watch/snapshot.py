"""The log of a stage that still writes it, as it was at the last checkpoint."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from kendama_cli.log.writer import McapLog


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
