"""OpenIGTLink, version 1: the two kinds of message that a haptic device's server and we exchange.

A header of 58 bytes (version, type, device name, time, size of the body, CRC-64 of the body), big-endian; TRANSFORM is
a 3 x 4 matrix of 32-bit floats in columns, STRING an encoding, a length and bytes (openigtlink.org/protocols). A
library of its own would share the interpreter with a loop of 1 kHz through threads; this one never blocks.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

from kendama_cli.errors import HardwareError

HEADER = struct.Struct(">H12s20sQQQ")
MATRIX = struct.Struct(">12f")
POLYNOMIAL, MASK = 0x42F0E1EBA9EA3693, 0xFFFFFFFFFFFFFFFF
LARGEST = 1_000_000
ASCII = 3


def _table() -> tuple[int, ...]:
    made = []
    for byte in range(256):
        value = byte << 56
        for _ in range(8):
            value = ((value << 1) ^ (POLYNOMIAL if value >> 63 else 0)) & MASK
        made.append(value)
    return tuple(made)


TABLE = _table()


def crc64(body: bytes) -> int:
    """CRC-64 of ECMA-182 from 0, as OpenIGTLink takes it of a message's body."""
    value = 0
    for byte in body:
        value = TABLE[(value >> 56) ^ byte] ^ ((value << 8) & MASK)
    return value


def message(kind: str, name: str, body: bytes) -> bytes:
    """A whole message."""
    return HEADER.pack(1, kind.encode(), name.encode(), 0, len(body), crc64(body)) + body


def transform(name: str, place: tuple[float, float, float]) -> bytes:
    """A TRANSFORM that is not turned."""
    return message("TRANSFORM", name, MATRIX.pack(1, 0, 0, 0, 1, 0, 0, 0, 1, *place))


def string(name: str, text: str) -> bytes:
    """A STRING."""
    return message("STRING", name, struct.pack(">HH", ASCII, len(text)) + text.encode("ascii"))


class IgtlLine:
    """A connected socket that sends and receives whole messages without ever waiting."""

    def __init__(self, connected: socket.socket) -> None:
        connected.setblocking(False)
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._pending = connected, b""

    def send(self, data: bytes) -> None:
        """Send what fits; raises HardwareError where the other end has gone."""
        try:
            self._socket.send(data)
        except BlockingIOError:  # the other end does not read; the next force will be newer
            return
        except OSError as error:
            raise HardwareError(f"the haptic device's server has closed the line ({error.strerror})") from None

    def receive(self) -> Iterator[tuple[str, str, bytes]]:
        """Every whole message that has come: type, device name, body; raises HardwareError for what is none."""
        try:
            data = self._socket.recv(65536)
            if not data:
                raise HardwareError("the haptic device's server has closed the line")
            self._pending += data
        except BlockingIOError:
            pass
        except OSError as error:
            raise HardwareError(f"the haptic device's server has closed the line ({error.strerror})") from None
        while len(self._pending) >= HEADER.size:
            version, kind, name, _, size, crc = HEADER.unpack_from(self._pending)
            if version not in (1, 2, 3) or size > LARGEST:
                raise HardwareError("what the haptic device's server sends is no OpenIGTLink; look at capture.port")
            if len(self._pending) < HEADER.size + size:
                return
            body = self._pending[HEADER.size : HEADER.size + size]
            self._pending = self._pending[HEADER.size + size :]
            if crc64(body) != crc:
                raise HardwareError("a message of the haptic device's server is damaged (its CRC does not fit)")
            if version == 1:
                yield kind.rstrip(b"\0").decode("ascii", "replace"), name.rstrip(b"\0").decode("ascii", "replace"), body
            else:  # an extended header of its own size comes before the content, metadata after it
                yield (
                    kind.rstrip(b"\0").decode("ascii", "replace"),
                    name.rstrip(b"\0").decode("ascii", "replace"),
                    _content(body),
                )

    def close(self) -> None:
        """Close it; idempotent."""
        self._socket.close()


def _content(body: bytes) -> bytes:
    extended, metadata_header, metadata = struct.unpack_from(">HHI", body)
    return body[extended : len(body) - metadata_header - metadata]
