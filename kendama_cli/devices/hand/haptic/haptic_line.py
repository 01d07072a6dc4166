"""The line to a haptic device's OpenIGTLink server: it never waits, for a loop of 1 kHz runs beside it."""

from __future__ import annotations

import socket
from collections.abc import Iterator

from kendama_cli.devices.hand.openigtlink import Message, MessageStream
from kendama_cli.errors import HardwareError

_CLOSED = "the haptic device's server has closed the line"


class HapticLine:
    """A connected socket that sends and receives whole messages without ever waiting."""

    def __init__(self, connected: socket.socket) -> None:
        connected.setblocking(False)
        if connected.family in (socket.AF_INET, socket.AF_INET6):
            connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._stream = connected, MessageStream()

    def send(self, data: bytes) -> None:
        """Send what fits; raises HardwareError where the other end has gone."""
        try:
            self._socket.send(data)
        except BlockingIOError:  # the other end does not read; the next force will be newer
            return
        except OSError as error:
            raise HardwareError(f"{_CLOSED} ({error.strerror})") from None

    def receive(self) -> Iterator[Message]:
        """Every whole message that has come; raises HardwareError for what is none, or damaged."""
        try:
            data = self._socket.recv(65536)
            if not data:
                raise HardwareError(_CLOSED)
        except BlockingIOError:
            return
        except OSError as error:
            raise HardwareError(f"{_CLOSED} ({error.strerror})") from None
        try:
            yield from self._stream.feed(data)
        except ValueError as wrong:
            raise HardwareError(f"the haptic device's server {wrong}; look at capture.host and capture.port") from None

    def close(self) -> None:
        """Close it; idempotent."""
        self._socket.close()
