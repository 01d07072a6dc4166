"""Tests that the process at the other end of a line still lives, as far as this machine can know."""

from __future__ import annotations

import errno
import socket

Address = tuple[str, int]


def has_socket(address: Address) -> bool | None:
    """Return True if a process of this machine has the UDP socket ``address``; None if that is another machine's.

    A socket ends with its process, and not while that is only stopped: what cannot be bound is held by somebody.
    """
    try:
        family, kind, proto, _, resolved = socket.getaddrinfo(*address, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, kind, proto) as probe:
            probe.bind(resolved)
    except OSError as error:
        return True if error.errno == errno.EADDRINUSE else None
    return False
