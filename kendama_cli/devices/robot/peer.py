"""The robot's process at the other end of a UDP socket: reached, heard, and looked after."""

from __future__ import annotations

import socket
from collections.abc import Callable
from contextlib import suppress

from kendama_cli.devices.robot import protocol
from kendama_cli.devices.robot.liveness import has_socket
from kendama_cli.errors import HardwareError


class Peer:
    """A socket connected to ``host:port``; ``fail`` makes the error of a problem that has been met.

    ``exit_reason`` says how a process that we started ended, None while it lives; without it the socket of a process
    on this machine tells. Raises HardwareError where the address is none.
    """

    def __init__(
        self, host: str, port: int, exit_reason: Callable[[], str | None] | None, fail: Callable[[str], HardwareError]
    ) -> None:
        self._exit_reason, self._fail = exit_reason, fail
        try:
            family, kind, proto, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._line = socket.socket(family, kind, proto)
            self._line.connect(address)  # the kernel then drops whatever a foreign sender sends us
        except OSError as error:
            raise HardwareError(f"the robot at {host}:{port} cannot be reached: {error}") from None
        self._address = (str(address[0]), int(address[1]))

    def send(self, data: bytes) -> None:
        """Send ``data``; raises HardwareError."""
        try:
            self._line.send(data)
        except ConnectionRefusedError:
            raise self._fail(self.ended() or "nothing listens there") from None
        except OSError as error:
            raise self._fail(f"the line cannot be written to: {error}") from None

    def send_anyway(self, data: bytes) -> None:
        """Send ``data`` where that can be done: where the other end is gone it cannot move either."""
        with suppress(OSError):
            self._line.send(data)

    def receive(self, timeout_s: float) -> bytes | None:
        """What comes next, None where nothing does; raises HardwareError."""
        self._line.settimeout(timeout_s)
        try:
            return self._line.recv(protocol.LARGEST_BYTES + 1)
        except ConnectionRefusedError:
            raise self._fail(self.ended() or "nothing listens there") from None
        except (TimeoutError, BlockingIOError):
            return None

    def ended(self) -> str | None:
        """How the process ended; None where it lives, or cannot be seen."""
        if self._exit_reason is not None:
            return self._exit_reason()
        return "nothing listens there" if has_socket(self._address) is False else None

    def seen_to_live(self) -> bool:
        """Whether the process is known to be there, though perhaps suspended or busy."""
        if self._exit_reason is not None:
            return self._exit_reason() is None
        return has_socket(self._address) is True

    def close(self) -> None:
        """Let go of the socket."""
        self._line.close()
