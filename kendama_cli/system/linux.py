"""Linux's own means: flock, which children inherit, a fork server, and the signal at the parent's death."""

from __future__ import annotations

import contextlib
import fcntl
import functools
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.system.interface import Starter, share_with_group

PR_SET_PDEATHSIG = 1


@dataclass(frozen=True)
class Flock:
    """A descriptor that holds a lock until it and all its copies are closed."""

    descriptor: int
    path: Path

    @property
    def inherited(self) -> tuple[int, ...]:
        """The descriptor: a child that has it holds the lock even where its parent was killed."""
        return (self.descriptor,)

    def release(self) -> None:
        """Close the descriptor; where no child holds the lock, its file is deleted by who holds it again for that."""
        os.close(self.descriptor)
        with contextlib.suppress(OSError), _flock(_open(self.path, os.O_RDWR), fcntl.LOCK_EX | fcntl.LOCK_NB):
            os.unlink(self.path)


class Linux:
    """See ``System``."""

    def try_lock(self, path: Path) -> Flock | None:
        """Return an exclusive flock, or None."""
        while True:
            descriptor = _open(path)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
                return None
            if os.fstat(descriptor).st_nlink:
                return Flock(descriptor, path)
            os.close(descriptor)  # its last holder has deleted the file since we opened it

    @contextlib.contextmanager
    def shared(self, path: Path) -> Iterator[None]:
        """Hold a shared flock."""
        with _flock(_open(path), fcntl.LOCK_SH):
            yield

    @contextlib.contextmanager
    def alone(self, path: Path) -> Iterator[None]:
        """Hold an exclusive flock; raises BlockingIOError."""
        with _flock(_open(path), fcntl.LOCK_EX | fcntl.LOCK_NB):
            yield

    @contextlib.contextmanager
    def mark_in_use(self, folder: Path) -> Iterator[None]:
        """Hold a flock on the folder itself, which leaves no file behind."""
        with contextlib.ExitStack() as held:
            with contextlib.suppress(OSError):  # a file system without locks
                held.enter_context(_flock(_open_folder(folder), fcntl.LOCK_EX | fcntl.LOCK_NB))
            yield

    def is_in_use(self, folder: Path) -> bool:
        """Return True if a shared flock on the folder is refused."""
        try:
            with _flock(_open_folder(folder), fcntl.LOCK_SH | fcntl.LOCK_NB):
                return False
        except OSError:
            return True

    def sync(self, path: Path) -> None:
        """Sync by fsync, which Linux takes of folders too."""
        handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

    def interpreters(self) -> Starter:
        """Start interpreters that inherit the lock and are asked to end by SIGTERM."""
        from kendama_cli.system.interpreters import Interpreters  # noqa: PLC0415 - a run with nothing to do has none

        return Interpreters(ended_by_signal=True)

    def sweep_starter(self) -> Starter:
        """Return a fork server: it pays for the imports of a stage once."""
        from kendama_cli.system.fork_server import ForkServer  # noqa: PLC0415 - only a sweep has one

        return ForkServer()

    def end_with_parent(self) -> None:
        """Ask the kernel for a signal at the parent's death; SIGTERM itself comes from the parent."""
        import signal  # noqa: PLC0415 - only workers need it

        _libc().prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


@functools.cache
def _libc() -> Any:
    """Return the C library, found by a fork server for all its forks."""
    import ctypes  # noqa: PLC0415 - only workers need it

    return ctypes.CDLL(None)


def _open(path: Path, how: int = os.O_RDWR | os.O_CREAT) -> int:
    """Open a lock's file; one of another user that may only be read can be locked too."""
    try:
        handle = os.open(path, how | os.O_CLOEXEC, 0o666)
        share_with_group(path)
        return handle
    except PermissionError:
        return os.open(path, os.O_RDONLY | os.O_CLOEXEC)


def _open_folder(folder: Path) -> int:
    return os.open(folder, os.O_RDONLY | os.O_CLOEXEC)


@contextlib.contextmanager
def _flock(descriptor: int, how: int) -> Iterator[None]:
    try:
        fcntl.flock(descriptor, how)
        yield
    finally:
        os.close(descriptor)
