"""A log's file in memory, for logs that are small and written at once."""

from __future__ import annotations

import io
from typing import BinaryIO


class MemoryFile:
    """See AppendFile."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def write(self, data: bytes) -> None:
        """Append ``data``."""
        self._bytes += data

    def cut(self, size: int) -> None:
        """Keep the first ``size`` bytes."""
        del self._bytes[size:]

    def reader(self) -> BinaryIO:
        """The file's content, from its start."""
        return io.BytesIO(bytes(self._bytes))
