"""OpenIGTLink, versions 1 to 3 (openigtlink.org/protocols): messages as bytes, and bytes as messages.

A header of 58 bytes (version, type, device name, time, size of the body, CRC-64 of the body), big-endian; from version
2 on an extended header opens the body and metadata end it. TRANSFORM is a 3 x 4 matrix of 32-bit floats in columns,
the last of them the position (by convention in mm); STRING an encoding, a length and bytes.

``pyigtl`` keeps only the newest message of each device and looks for it every 10 ms, so a recording through it loses
samples, and its threads would share the interpreter with a loop of 1 kHz; the tests let its server speak to this.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

HEADER = struct.Struct(">H12s20sQQQ")
EXTENDED = struct.Struct(">HHI")
"""Size of the extended header, of the metadata's header, of the metadata."""
TRANSFORM = struct.Struct(">12f")
MAX_BODY_BYTES = 1 << 24
WANTED = ("TRANSFORM", "STRING")
ASCII = 3
TEXT_BEGINS = struct.calcsize(">HH")
"""A STRING's text comes after its encoding and its length."""
POLYNOMIAL, MASK = 0x42F0E1EBA9EA3693, 0xFFFFFFFFFFFFFFFF


@dataclass(frozen=True)
class Message:
    """One message; ``stamp_s`` is the sender's own, ``content`` is without extended header and metadata."""

    kind: str
    device: str
    stamp_s: float
    content: bytes


class MessageStream:
    """Takes bytes as they come, and yields the whole messages among them, of the kinds ``WANTED`` alone."""

    def __init__(self) -> None:
        self._pending = bytearray()

    def feed(self, data: bytes) -> Iterator[Message]:
        """Yield the messages that ``data`` completes; raises ValueError for what is no OpenIGTLink, or damaged."""
        self._pending += data
        while len(self._pending) >= HEADER.size:
            version, kind, device, stamp, size, checksum = HEADER.unpack_from(self._pending)
            if not 1 <= version <= 3 or size > MAX_BODY_BYTES:
                raise ValueError(f"does not speak OpenIGTLink (version {version}, {size} bytes)")
            if len(self._pending) < HEADER.size + size:
                return
            body = bytes(self._pending[HEADER.size : HEADER.size + size])
            del self._pending[: HEADER.size + size]
            named = _name(kind)
            if named not in WANTED:  # images, say: nothing is computed of them
                continue
            if crc64(body) != checksum:
                raise ValueError(f"sent a damaged {named}: its checksum does not fit")
            yield Message(named, _name(device), stamp / 2**32, body if version == 1 else _content(body))


def _name(field: bytes) -> str:
    return field.rstrip(b"\0").decode("utf-8", "replace")


def _content(body: bytes) -> bytes:
    if len(body) < EXTENDED.size:
        raise ValueError(f"sent a body of {len(body)} bytes, too short for its extended header")
    extended, metadata_header, metadata = EXTENDED.unpack_from(body)
    return body[extended : len(body) - metadata_header - metadata]


def transform(device: str, position: tuple[float, float, float]) -> bytes:
    """Return a TRANSFORM of version 1 without rotation."""
    return _message("TRANSFORM", device, TRANSFORM.pack(1, 0, 0, 0, 1, 0, 0, 0, 1, *position))


def string(device: str, text: str) -> bytes:
    """Return a STRING of version 1, in ASCII."""
    return _message("STRING", device, struct.pack(">HH", ASCII, len(text)) + text.encode("ascii"))


def _message(kind: str, device: str, body: bytes) -> bytes:
    return HEADER.pack(1, kind.encode(), device.encode(), 0, len(body), crc64(body)) + body


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
    """Return the CRC-64 of ECMA-182 from 0, as OpenIGTLink takes it of a message's body."""
    value = 0
    for byte in body:
        value = TABLE[(value >> 56) ^ byte] ^ ((value << 8) & MASK)
    return value
