"""Services of the operating system: locks, worker processes, durable names; and the choice of their implementation."""

from __future__ import annotations

import contextlib
import functools
import os
import stat
import sys
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import IO, Any, Protocol


class Lock(Protocol):
    """A lock that this process holds; the system releases it when its holders have ended."""

    @property
    def inherited(self) -> tuple[int, ...]:
        """File descriptors with which a child process holds the lock too; none where it cannot."""

    def release(self) -> None:
        """Let go of it; children that inherited it hold it until they end."""


class Worker(Protocol):
    """A process that runs one stage; ``events`` is what it reports, one JSON document a line."""

    events: IO[bytes]

    def ask_to_end(self) -> None:
        """Have it interrupt its stage and end."""

    def kill(self) -> None:
        """End it at once."""

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its exit code, negative for a signal; raises subprocess.TimeoutExpired."""


class Starter(Protocol):
    """Starts worker processes."""

    def start(self, request: Mapping[str, Any], *, lock: Lock, printed: int) -> Worker:
        """Start a worker for ``request``; what it prints goes to the file descriptor ``printed``."""

    def close(self) -> None:
        """End what stays open between workers."""


class System(Protocol):
    """The operating system; every method but ``end_with_parent`` is safe from several threads."""

    def try_lock(self, path: Path) -> Lock | None:
        """Return the lock on the file ``path``, which is made; None where another process has it. Raises OSError."""

    def shared(self, path: Path) -> AbstractContextManager[None]:
        """Hold ``path`` together with others that share it; waits while one has it alone. Raises OSError."""

    def alone(self, path: Path) -> AbstractContextManager[None]:
        """Hold ``path`` against all others; raises BlockingIOError where one has it, and OSError."""

    def mark_in_use(self, folder: Path) -> AbstractContextManager[None]:
        """Have ``is_in_use`` true of ``folder`` meanwhile; without effect where the file system knows no locks."""

    def is_in_use(self, folder: Path) -> bool:
        """Return True if a living process has marked ``folder``; true where that cannot be found out."""

    def sync(self, path: Path) -> None:
        """Have a file, or the names in a folder, on the disk. Raises OSError."""

    def interpreters(self) -> Starter:
        """Start workers that are interpreters of their own: each costs its stage's imports, and shares nothing."""

    def sweep_starter(self) -> Starter:
        """Start workers for many runs one after the other, one at a time."""

    def end_with_parent(self) -> None:
        """Raise SIGTERM in this process when its parent has ended or asks for it, so that nothing is left running."""


OF_A_GROUP = stat.S_ISGID | stat.S_IWGRP


def share_with_group(path: Path) -> None:
    """Let the group write a new file or folder whose folder a group shares (setgid, and the group may write)."""
    with contextlib.suppress(OSError):  # somebody else's: it is as they made it
        if os.stat(path.parent).st_mode & OF_A_GROUP == OF_A_GROUP:
            mode = os.stat(path).st_mode
            os.chmod(path, stat.S_IMODE(mode) | (0o2770 if stat.S_ISDIR(mode) else 0o660))


PORTABLE = "KENDAMA_PORTABLE"
"""The environment variable that, set to 1, chooses the portable implementation on Linux too; workers inherit it."""


@functools.cache
def system() -> System:
    """Return Linux's own means on Linux, what Python offers everywhere elsewhere."""
    if is_portable():
        from kendama_cli.system.portable import Portable  # noqa: PLC0415 - either is imported only where it is used

        return Portable()
    from kendama_cli.system.linux import Linux  # noqa: PLC0415 - its modules are not everywhere

    return Linux()


def is_portable() -> bool:
    """Return True if the portable implementation is chosen."""
    return sys.platform != "linux" or os.environ.get(PORTABLE, "") not in ("", "0")
