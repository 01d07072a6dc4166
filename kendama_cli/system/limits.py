"""A bound on what a library of others may take while it reads a file, where the system knows one."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

MOST_BYTES = 700 << 20


@contextlib.contextmanager
def bounded(more_bytes: int = MOST_BYTES) -> Iterator[None]:
    """Have memory beyond ``more_bytes`` raise MemoryError meanwhile, and a file beyond them OSError; on Linux only."""
    if sys.platform != "linux":
        yield
        return
    import resource  # noqa: PLC0415 - on Unix only

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = [(kind, *resource.getrlimit(kind)) for kind in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE)]
    try:
        for (kind, soft, hard), most in zip(before, (used + more_bytes, more_bytes), strict=True):
            resource.setrlimit(kind, (most if soft == resource.RLIM_INFINITY else min(soft, most), hard))
        yield
    finally:
        for kind, soft, hard in before:
            resource.setrlimit(kind, (soft, hard))
