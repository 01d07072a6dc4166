"""Choice between the ways of using the operating system."""

from __future__ import annotations

import functools
import os
import sys

from kendama_cli.system.interface import System

PORTABLE = "KENDAMA_PORTABLE"
"""The environment variable that, set to 1, takes the portable way on Linux too; workers inherit it."""


@functools.cache
def system() -> System:
    """Return Linux's own means on Linux, what Python offers everywhere elsewhere."""
    if is_portable():
        from kendama_cli.system.portable import Portable  # noqa: PLC0415 - either is imported only where it is used

        return Portable()
    from kendama_cli.system.linux import Linux  # noqa: PLC0415 - fcntl is not everywhere

    return Linux()


def is_portable() -> bool:
    """Return True if the portable way is taken."""
    return sys.platform != "linux" or os.environ.get(PORTABLE, "") not in ("", "0")
