"""A UDP socket as a line of datagrams of the robot's protocol."""

from __future__ import annotations

import socket

from kendama_cli.devices.robot.protocol import LARGEST_BYTES, Datagram, pack

Address = tuple[str, int]


class DatagramLine:
    """Receives whatever comes, of any sender; sends datagrams."""

    def __init__(self, line: socket.socket) -> None:
        self._line = line

    def receive(self, timeout_s: float) -> tuple[bytes, Address] | None:
        """The next datagram's bytes, one more at most than any may have, with its sender; None where none comes."""
        self._line.settimeout(timeout_s)
        try:
            data, sender = self._line.recvfrom(LARGEST_BYTES + 1)
        except (TimeoutError, BlockingIOError, ConnectionError):
            return None
        return data, sender

    def send(self, datagram: Datagram, receiver: Address) -> None:
        """Send ``datagram``; raises OSError where the line cannot be written to."""
        self._line.sendto(pack(datagram), receiver)
