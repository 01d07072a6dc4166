"""Stand-ins for libGL and libX11, which DART's wheel links against for its viewer alone and which we never call.

Servers, containers and WSL often have neither, and the import of DART would fail there. Beside this file lie shared
objects with the same sonames, whose functions do nothing and return 0 (data/display_stubs.py makes them).
"""

from __future__ import annotations

import ctypes
import platform
import sys
from pathlib import Path

SONAMES = ("libX11.so.6", "libGL.so.1")
"""In the order in which they are loaded."""
MACHINES = ("x86_64", "aarch64")
"""Those for which DART has Linux wheels."""


def stub_path(soname: str, machine: str) -> Path:
    """Return the stand-in for ``soname`` on ``machine``; it exists for ``SONAMES`` and ``MACHINES``."""
    return Path(__file__).with_name(f"{soname.partition('.')[0]}-{machine}.so")


def load_display_libraries() -> tuple[str, ...]:
    """Load the system's display libraries, or the stand-in of each that it lacks; the sonames of those stood in for.

    Does nothing on macOS and Windows, whose wheels bring what they need.
    """
    if sys.platform != "linux" or platform.machine() not in MACHINES:
        return ()
    stood_in = []
    for soname in SONAMES:
        try:
            ctypes.CDLL(soname)
        except OSError:
            # global: libraries that are loaded later find the functions here, as the linker knows the soname already
            ctypes.CDLL(str(stub_path(soname, platform.machine())), mode=ctypes.RTLD_GLOBAL)
            stood_in.append(soname)
    return tuple(stood_in)
