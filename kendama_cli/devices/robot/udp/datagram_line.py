"""A UDP socket as a line of datagrams."""

from __future__ import annotations

import socket
from contextlib import suppress

from kendama_cli.devices.robot.udp.liveness import Address
from kendama_cli.devices.robot.udp.protocol import LARGEST_BYTES

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
            data, sender = self._line.recvfrom(LARGEST_BYTES + 1)
        except (TimeoutError, BlockingIOError, ConnectionError):
            return None
        return data, sender

    def send(self, data: bytes, receiver: Address) -> None:
        """Send ``data``; raises OSError where the line cannot be written to."""
        self._line.sendto(data, receiver)
