"""Places that several homes share: a folder, or a bucket of an object store; named blobs, each whole or absent."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Protocol

from kendama_cli.errors import OfflineError, StoreError
from kendama_cli.settings.store import StoreSettings
from kendama_cli.store import durable
from kendama_cli.store.home import claim

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

    def put(self, name: str, content: bytes | Path) -> None:
        """Make ``content``, or that of a file, the blob: at once, whatever another writer does."""

    def names(self, prefix: str) -> Iterator[str]:
        """Return every blob whose name begins with the folder ``prefix``."""


def open_remote(settings: StoreSettings) -> Remote | None:
    """Open what ``settings`` name; None if they name nothing. Raises MissingPartError if a library is missing."""
    if settings.remote is None:
        return None
    if "://" not in settings.remote:
        return FolderRemote(settings.remote)
    from kendama_cli.plugins.cluster.remote_bucket import BucketRemote  # noqa: PLC0415 - a library of its own

    return BucketRemote(settings)


class Reached:
    """Context whose errors go to ``absent``: it raises ours, or returns True for what alone is not there."""

    def __init__(self, absent: Callable[[BaseException], bool]) -> None:
        self._absent = absent

    def __enter__(self) -> None:
        """Do nothing: there is nothing to prepare."""

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        return error is not None and self._absent(error)


class FolderRemote:
    """A folder that several machines mount. It is never made: an empty mount point is not the shared store."""

    def __init__(self, place: str) -> None:
        """Raise UsageError where it is a folder of somebody else."""
        self.place = place
        self._folder = Path(os.path.expanduser(place)).absolute()
        with contextlib.suppress(StoreError):  # who may only read it can use it
            if self._folder.is_dir():
                claim(self._folder, "--remote or store.remote")

    def read(self, name: str) -> bytes | None:
        """See ``Remote``."""
        with self._reached():
            path = self._folder / name
            return path.read_bytes() if path.stat().st_size <= LARGEST_READ else b""
        return None

    def fetch(self, name: str, target: Path) -> bool:
        """See ``Remote``."""
        with self._reached(), (self._folder / name).open("rb") as source, target.open("wb") as stream:
            shutil.copyfileobj(source, stream, 1 << 20)
            return True
        return False

    def opened(self, name: str, scratch: Path) -> IO[bytes] | None:
        """See ``Remote``."""
        size = self.size(name)
        if size is not None and size <= SMALL_BYTES:
            data = self.read(name)
            return None if data is None else io.BytesIO(data)
        return scratch.open("rb") if self.fetch(name, scratch) else None

    def size(self, name: str) -> int | None:
        """See ``Remote``."""
        with self._reached():
            return (self._folder / name).stat().st_size
        return None

    def put(self, name: str, content: bytes | Path) -> None:
        """See ``Remote``."""
        with self._reached():
            if isinstance(content, Path):
                durable.copy_file(content, self._folder / name)
            else:
                durable.write_file(self._folder / name, content)

    def names(self, prefix: str) -> Iterator[str]:
        """See ``Remote``."""
        with self._reached():
            found = [
                Path(place, name)
                for place, _, names in os.walk(self._folder / prefix)
                for name in names
                if not name.startswith(durable.SCRATCH)
            ]
            yield from sorted(path.relative_to(self._folder).as_posix() for path in found)

    def _reached(self) -> Reached:
        if not self._folder.is_dir():
            raise OfflineError(self.place, f"store.remote={self.place}: there is no such folder (is it mounted?)")
        return Reached(self._absent)

    def _absent(self, error: BaseException) -> bool:
        """Raise an OfflineError for what the file system refuses."""
        cause = error.__cause__ if isinstance(error, StoreError) else error
        if isinstance(cause, OSError) and not isinstance(error, FileNotFoundError | NotADirectoryError):
            raise OfflineError(self.place, f"store.remote={self.place}: {cause.strerror or cause}") from error
        return cause is error and isinstance(error, OSError)
