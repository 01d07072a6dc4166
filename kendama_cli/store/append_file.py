"""A file that grows while a stage runs; what a checkpoint counts of it is durable before the checkpoint is."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import BinaryIO

from kendama_cli.store import durable
from kendama_cli.system.group import share_with_group


class DurableAppendFile:
    """Begins anew with the first write unless it was cut: what a killed run left beyond its checkpoint is gone.

    Every method raises StoreError where the disk refuses, but ``reader``, which raises OSError.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: io.FileIO | None = None
        self._unsynced = False

    def write(self, data: bytes) -> None:
        """Append ``data``."""
        file = self._file or self._open("w")
        self._unsynced = True
        left = memoryview(data)
        with durable.plain_disk_errors(self.path):
            while left:
                left = left[file.write(left) :]

    def sync(self) -> None:
        """Flush all that was written to the disk."""
        if self._file is None or not self._unsynced:
            return
        with durable.plain_disk_errors(self.path):
            os.fsync(self._file.fileno())
            durable.sync(self.path.parent)
        self._unsynced = False

    def cut(self, size: int) -> None:
        """Keep the first ``size`` bytes."""
        file = self._file or self._open("r+" if self.path.exists() else "w")
        with durable.plain_disk_errors(self.path):
            file.truncate(size)
            file.seek(size)

    def reader(self) -> BinaryIO:
        """Return the file's content, from its start."""
        return self.path.open("rb")

    def close(self) -> None:
        """Let go of the file; it stays where it is."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _open(self, mode: str) -> io.FileIO:
        durable.make_folder(self.path.parent)
        with durable.plain_disk_errors(self.path):
            self._file = io.FileIO(self.path, mode)
            share_with_group(self.path)
        return self._file
