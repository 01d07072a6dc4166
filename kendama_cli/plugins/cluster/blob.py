"""Named blobs, each whole or absent, as a place that several homes share holds them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import IO, Protocol

SMALL_BYTES = 1 << 20
"""A blob of so many bytes or fewer is held in memory on its way: making and deleting a file costs more than it."""
LARGEST_READ = 1 << 26
"""No record of ours has so many bytes; what has more is read as an empty one, which is a damaged one."""


class Remote(Protocol):
    """Blobs by name, such as ``results/learn/KEY.json``; whoever reads one checks what it holds.

    Every method is safe beside others that write the same name, from several threads too, and raises OfflineError
    where the place cannot be reached now, RemoteError where it is none or refuses.
    """

    place: str
    """Name of the store in the configuration."""

    def read(self, name: str) -> bytes | None:
        """Return a small blob; None where there is none."""

    def fetch(self, name: str, target: Path) -> bool:
        """Copy a blob to the new file ``target``; False where there is none."""

    def opened(self, name: str, scratch: Path) -> IO[bytes] | None:
        """Open a blob to read, which the caller closes; a large one is copied to the new file ``scratch`` first.

        None where there is none.
        """

    def size(self, name: str) -> int | None:
        """Return the size of a blob [bytes]; None if there is none."""

    def write(self, name: str, source: Path) -> None:
        """Make the content of ``source`` the blob: at once, whatever another writer does."""

    def put(self, name: str, data: bytes) -> None:
        """Write a small blob, as ``write`` does."""

    def names(self, prefix: str) -> Iterator[str]:
        """Return every blob whose name begins with the folder ``prefix``."""
