"""The line to a haptic device's server: it never waits, for a loop of 1 kHz runs beside it."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

from kendama_cli.errors import HardwareError

Said = TypeVar("Said")
_CLOSED = "the haptic device's server has closed the line: look at it, start it anew, and run again"


class HapticLine(Generic[Said]):
    """A connected socket that sends and receives whole messages without ever waiting."""

    def __init__(self, connected: socket.socket, feed: Callable[[bytes], Iterator[Said]]) -> None:
        """Parse incoming bytes by ``feed``, which raises ValueError for foreign ones."""
        connected.setblocking(False)
        if connected.family in (socket.AF_INET, socket.AF_INET6):
            connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._feed = connected, feed

    def send(self, data: bytes) -> None:
        """Send what fits; raises HardwareError where the other end has gone."""
        try:
            self._socket.send(data)
        except BlockingIOError:  # the other end does not read; the next force will be newer
            return
        except OSError as error:
            raise HardwareError(f"{_CLOSED} ({error.strerror})") from None

    def receive(self) -> Iterator[Said]:
        """Yield every whole message that has come; raises HardwareError for a foreign or damaged one."""
        try:
            data = self._socket.recv(65536)
            if not data:
                raise HardwareError(_CLOSED)
        except BlockingIOError:
            return
        except OSError as error:
            raise HardwareError(f"{_CLOSED} ({error.strerror})") from None
        try:
            yield from self._feed(data)
        except ValueError as wrong:
            raise HardwareError(
                f"the haptic device's server {wrong}; look at capture.protocol and capture.port"
            ) from None

    def close(self) -> None:
        """Close it; idempotent."""
        self._socket.close()
