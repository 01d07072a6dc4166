"""A UDP socket as a line of datagrams."""

from __future__ import annotations

import errno
import socket
from contextlib import suppress

from kendama_cli.devices.robot.udp.protocol import MAX_BYTES

_BUFFER_BYTES = 1 << 22
"""Asked of the system, which may give less: room for a flood beside the commander's datagrams."""


class DatagramLine:
    """Receives whatever comes, of any sender; sends datagrams."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line
        with suppress(OSError):
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)

    def receive(self, timeout_s: float) -> tuple[bytes, Address] | None:
        """Return the next datagram's bytes, one more at most than any may have, with its sender; None if none comes."""
        self._line.settimeout(timeout_s)
        try:
            data, sender = self._line.recvfrom(MAX_BYTES + 1)
        except (TimeoutError, BlockingIOError, ConnectionError):
            return None
        return data, sender

    def send(self, data: bytes, receiver: Address) -> None:
        """Send ``data``; raises OSError where the line cannot be written to."""
        self._line.sendto(data, receiver)


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
