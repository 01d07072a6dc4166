"""Services that Python and ``filelock`` offer on every system; howto/platforms.md says what they guarantee less."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from filelock import BaseFileLock, FileLock, Timeout

from kendama_cli.system.interface import Starter

IN_USE = "in_use.lock"
PROBE_S = 0.2
"""How long a lock may be held by others that only probe it."""
END_S = 10.0
"""A worker that was asked to end and has not by then ends without being asked."""


@dataclass(frozen=True)
class HeldFile:
    """A lock of this process alone."""

    lock: BaseFileLock

    @property
    def inherited(self) -> tuple[int, ...]:
        """Nothing: a child cannot hold it."""
        return ()

    def release(self) -> None:
        """Delete its file and release it; Windows deletes no file that is open, and POSIX none that another holds."""
        if os.name != "nt":
            self._delete()
        self.lock.release()
        if os.name == "nt":
            self._delete()

    def _delete(self) -> None:
        with contextlib.suppress(OSError):
            os.unlink(self.lock.lock_file)


class Portable:
    """See ``System``."""

    def try_lock(self, path: Path) -> HeldFile | None:
        """Return an exclusive lock, or None."""
        lock = _file_lock(path)
        return HeldFile(lock) if _taken(lock, 0.0) else None

    @contextlib.contextmanager
    def shared(self, path: Path) -> Iterator[None]:
        """Hold a lock on a file of one's own beside ``path``, made and locked while holding ``path``."""
        users = _users(path)
        own = _file_lock(users / f"{os.urandom(16).hex()}.lock")
        with _file_lock(path):
            users.mkdir(exist_ok=True)
            own.acquire()
        try:
            yield
        finally:
            own.release()
            with contextlib.suppress(OSError):
                os.unlink(own.lock_file)

    @contextlib.contextmanager
    def alone(self, path: Path) -> Iterator[None]:
        """Yield ``path``, if no user's file beside it is locked; files of users that were killed are deleted."""
        gate = _file_lock(path)
        # one that begins or ends at this moment holds the file for an instant only
        if not _taken(gate, PROBE_S):
            raise BlockingIOError(f"{path} is in use")
        try:
            for file in _users(path).glob("*.lock"):
                user = _file_lock(file)
                if not _taken(user, 0.0):
                    raise BlockingIOError(f"{path} is in use")
                user.release()
                file.unlink(missing_ok=True)
            yield
        finally:
            gate.release()

    @contextlib.contextmanager
    def mark_in_use(self, folder: Path) -> Iterator[None]:
        """Hold a locked file in the folder."""
        lock = _file_lock(folder / IN_USE)
        with contextlib.suppress(OSError):  # a file system without locks
            _taken(lock, PROBE_S)
        try:
            yield
        finally:
            lock.release()
            with contextlib.suppress(OSError):
                os.unlink(lock.lock_file)

    def is_in_use(self, folder: Path) -> bool:
        """Return True if the folder has the file and it is locked."""
        file = folder / IN_USE
        if not file.exists():
            return False
        lock = _file_lock(file)
        try:
            taken = _taken(lock, PROBE_S)
        except OSError:
            return True
        lock.release()
        return not taken

    def sync(self, path: Path) -> None:
        """Sync a file by fsync; the names in a folder are left to the file system, which takes no fsync everywhere."""
        if path.is_dir():
            return
        handle = os.open(path, os.O_RDWR)  # Windows flushes only what may be written
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

    def interpreters(self) -> Starter:
        """Start interpreters that end when their standard input does."""
        from kendama_cli.system.interpreters import Interpreters  # noqa: PLC0415 - a run with nothing to do has none

        return Interpreters(ended_by_signal=False)

    def sweep_starter(self) -> Starter:
        """Start interpreters too: a process cannot be forked everywhere."""
        return self.interpreters()

    def end_with_parent(self) -> None:
        """Watch standard input, whose end comes when the parent closes it or dies."""
        threading.Thread(target=_end_with_input, daemon=True).start()


def _end_with_input() -> None:
    while os.read(0, 4096):  # not sys.stdin: its lock would keep the process from ending
        pass
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, signal.SIGTERM)  # raised here it would not wake the main thread from a system call
    else:
        signal.raise_signal(signal.SIGTERM)
    threading.Event().wait(END_S)
    os._exit(1)


def _file_lock(path: Path) -> BaseFileLock:
    # not a soft lock where there are no others: that would stay after a kill
    return FileLock(path, mode=0o666, thread_local=False, fallback_to_soft=False)


def _taken(lock: BaseFileLock, timeout_s: float) -> bool:
    try:
        lock.acquire(timeout=timeout_s)
    except Timeout:
        return False
    return True


def _users(path: Path) -> Path:
    return path.with_name(f"{path.name}.users")
